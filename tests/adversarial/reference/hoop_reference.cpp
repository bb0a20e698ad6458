#include "tests/adversarial/reference/hoop_reference.hpp"

#include <algorithm>

#include "common/base/check.hpp"

namespace pvsfarm::reference {
namespace {

// All corners of the cell, of the loop: on the positive side or on the plane.
bool supports(const HalfSpace& plane, const IntBox& cell, const Loop& loop) {
  const auto positive = [&](const IntPoint& x) {
    return orientation(plane.p, plane.q, plane.r, x) >= 0;
  };
  const auto corners = cell.corners();
  return std::all_of(corners.begin(), corners.end(), positive) &&
         std::all_of(loop.begin(), loop.end(), positive);
}

}  // namespace

Place place(const IntBox& box, const HalfSpace& h) {
  int positive = 0;
  for (const IntPoint& corner : box.corners()) positive += orientation(h.p, h.q, h.r, corner) > 0;
  return positive == 8 ? Place::kInside : positive == 0 ? Place::kOutside : Place::kTraversed;
}

bool turns_left(const IntBox& cell, const Loop& loop) {
  const std::size_t n = loop.size();
  for (const IntPoint& v : cell.corners())
    for (std::size_t i = 0; i < n; ++i)
      if (orientation(v, loop[i], loop[(i + 1) % n], loop[(i + 2) % n]) <= 0) return false;
  return n >= 3;
}

bool seen_convex(const IntBox& cell, const Loop& loop) {
  const std::size_t n = loop.size();
  for (const IntPoint& v : cell.corners())
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 2; j < n; ++j)
        if (orientation(v, loop[i], loop[(i + 1) % n], loop[(i + j) % n]) <= 0) return false;
  return n >= 3;
}

std::vector<HalfSpace> shadow(const IntBox& cell, const Loop& loop, std::int64_t farthest_z,
                              Rear rear) {
  std::vector<HalfSpace> half_spaces;
  for (std::size_t i = 0; i < loop.size(); ++i)
    for (const IntPoint& v : cell.corners()) {
      const HalfSpace plane{v, loop[i], loop[(i + 1) % loop.size()]};
      if (supports(plane, cell, loop)) half_spaces.push_back(plane);
    }
  if (rear == Rear::kClosed) {
    const std::int64_t x = loop[0][0], y = loop[0][1];
    half_spaces.push_back(
        {{{x, y, farthest_z}}, {{x + 1, y, farthest_z}}, {{x, y + 1, farthest_z}}});
  }
  return half_spaces;
}

ShadowOctree::ShadowOctree(const IntBox& root, int depth, Colour colour)
    : nodes_{{root, colour, depth}} {
  for (int k = 0; k < 3; ++k)
    PVS_CHECK_EQ((root.hi[k] - root.lo[k]) % (std::int64_t{1} << depth), 0);
}

void ShadowOctree::split(int node, Colour colour) {
  const IntBox box = nodes_[node].box;
  const int depth_left = nodes_[node].depth_left - 1;
  nodes_[node].colour = Colour::kGrey;
  nodes_[node].children = static_cast<int>(nodes_.size());
  for (int k = 0; k < 8; ++k) {
    IntBox child = box;
    for (int axis = 0; axis < 3; ++axis)
      ((k >> axis & 1) ? child.lo : child.hi)[axis] = (box.lo[axis] + box.hi[axis]) / 2;
    nodes_.push_back({child, colour, depth_left});
  }
}

void ShadowOctree::update_first(int node, const HalfSpace& plane) {
  if (const int children = nodes_[node].children; children >= 0) {
    for (int k = 0; k < 8; ++k) update_first(children + k, plane);
    return;
  }
  Colour& colour = nodes_[node].colour;
  switch (place(nodes_[node].box, plane)) {
    case Place::kOutside:
      if (colour == Colour::kUndetermined || colour == Colour::kBlack) colour = Colour::kWhite;
      return;
    case Place::kInside:
      if (colour == Colour::kUndetermined) colour = Colour::kBlack;
      return;
    case Place::kTraversed:
      if (nodes_[node].depth_left == 0) {
        colour = Colour::kWhite;
        return;
      }
      split(node, Colour::kUndetermined);
      for (int k = 0, first = nodes_[node].children; k < 8; ++k) update_first(first + k, plane);
  }
}

void ShadowOctree::update_second(int node, const HalfSpace& plane) {
  if (const int children = nodes_[node].children; children >= 0) {
    for (int k = 0; k < 8; ++k) update_second(children + k, plane);
    return;
  }
  Colour& colour = nodes_[node].colour;
  if (colour == Colour::kBlack) return;  // by table 2, whatever the plane says
  switch (place(nodes_[node].box, plane)) {
    case Place::kOutside:
      colour = Colour::kWhite;
      return;
    case Place::kInside:
      if (colour == Colour::kWhite) colour = Colour::kInside;
      if (colour == Colour::kUndetermined) colour = Colour::kBlack;
      return;
    case Place::kTraversed:
      if (nodes_[node].depth_left == 0) {
        colour = Colour::kWhite;
        return;
      }
      split(node, Colour::kUndetermined);
      for (int k = 0, first = nodes_[node].children; k < 8; ++k) update_second(first + k, plane);
  }
}

void ShadowOctree::add_shadow(int node, const std::vector<HalfSpace>& half_spaces) {
  if (nodes_[node].colour == Colour::kBlack) return;
  std::vector<HalfSpace> open;  // those that cut this node
  for (const HalfSpace& h : half_spaces) {
    const Place where = place(nodes_[node].box, h);
    if (where == Place::kOutside) return;  // keeps what earlier hoops made of it
    if (where == Place::kTraversed) open.push_back(h);
  }
  if (open.empty()) {
    nodes_[node].colour = Colour::kBlack;
    nodes_[node].children = -1;
    return;
  }
  if (nodes_[node].depth_left == 0) return;
  if (nodes_[node].children < 0) split(node, nodes_[node].colour);
  for (int k = 0, first = nodes_[node].children; k < 8; ++k) add_shadow(first + k, open);
}

std::vector<IntBox> ShadowOctree::black() const {
  std::vector<IntBox> boxes;
  std::vector<int> open{0};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (node.children >= 0)
      for (int k = 0; k < 8; ++k) open.push_back(node.children + k);
    else if (node.colour == Colour::kBlack || node.colour == Colour::kInside)
      boxes.push_back(node.box);
  }
  return boxes;
}

}  // namespace pvsfarm::reference
