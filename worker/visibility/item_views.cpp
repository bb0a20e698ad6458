#include "worker/visibility/item_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pvsfarm {
namespace {

constexpr double kNearest = 1e-5;  // of the scene's diagonal

constexpr std::array<ItemView, 6> kViews{ItemView{0, 1},  ItemView{0, -1}, ItemView{1, 1},
                                         ItemView{1, -1}, ItemView{2, 1},  ItemView{2, -1}};

// Whether a box, given relative to the eye, may have a point in the view's pyramid.
bool in_view(const Box& box, const ItemView& view) {
  const double ahead = view.sign > 0 ? box.hi[view.axis] : -box.lo[view.axis];
  if (!(ahead > 0)) return false;
  for (const int side : {1, 2}) {
    const int a = (view.axis + side) % 3;
    if (box.lo[a] > ahead || box.hi[a] < -ahead) return false;
  }
  return true;
}

bool is_opaque(const ObjectRecord& object) { return object.occluder != 0 && object.dynamic == 0; }

}  // namespace

ItemViews::ItemViews(std::shared_ptr<const Scene> scene, int side_px)
    : scene_(std::move(scene)), buffer_(side_px), object_of_(scene_->all_triangles().size()) {
  for (std::uint32_t o = 0; o < scene_->object_count(); ++o) {
    const ObjectRecord& object = scene_->object(ObjectId{o});
    has_passable_ |= !is_opaque(object);
    std::fill_n(object_of_.begin() + static_cast<std::ptrdiff_t>(object.first_triangle),
                object.triangle_count, o);
  }
}

// Adds the triangles that face the eye to every view that may show them.
void ItemViews::add_object(ObjectId id, const Vec3& eye) {
  const ObjectRecord& object = scene_->object(id);
  const Box box{object.box.lo - eye, object.box.hi - eye};
  std::array<bool, 6> shows{};
  for (std::size_t v = 0; v < kViews.size(); ++v) shows[v] = in_view(box, kViews[v]);
  if (std::find(shows.begin(), shows.end(), true) == shows.end()) return;
  const std::span<const Vec3> vertices = scene_->vertices();
  const std::span<const Triangle> triangles = scene_->triangles(id);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::array<Vec3, 3> p;
    Box around;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = vertices[triangles[t].vertex[k]] - eye;
      around.add(p[k]);
    }
    if (object.two_sided == 0 && dot(cross(p[1] - p[0], p[2] - p[0]), p[0]) >= 0) continue;
    const auto item = static_cast<std::uint32_t>(object.first_triangle + t);
    for (std::size_t v = 0; v < kViews.size(); ++v) {
      if (!shows[v] || !in_view(around, kViews[v])) continue;
      for (const Vec3& q : p)
        triangles_[v].push_back(
            {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), item});
    }
  }
}

void ItemViews::gather(const Vec3& eye, const VisibleSet& drawn, bool passable) {
  for (std::uint32_t o = 0; o < scene_->object_count(); ++o) {
    const ObjectRecord& object = scene_->object(ObjectId{o});
    if (is_opaque(object) == passable) continue;
    if (object.occludee == 0 || drawn.contains(ObjectId{o})) add_object(ObjectId{o}, eye);
  }
}

// Along each row, the middle pixel of every run of one triangle.
void ItemViews::read(const ItemView& view, std::span<const std::uint32_t> pixels,
                     const VisibleSet& wanted) {
  const int side = buffer_.side_px();
  const auto at = [side](double i) { return (2 * i + 1) / side - 1; };
  for (int j = 0; j < side; ++j) {
    const std::uint32_t* row = pixels.data() + static_cast<std::size_t>(j) * side;
    for (int first = 0, i = 1; i <= side; ++i) {
      if (i < side && row[i] == row[first]) continue;
      const std::uint32_t item = row[first];
      const int middle = (first + i - 1) / 2;
      first = i;
      if (item == kNoItem || !wanted.contains(ObjectId{object_of_[item]})) continue;
      Vec3 direction{0};
      direction[view.axis] = view.sign;
      direction[(view.axis + 1) % 3] = at(middle);
      direction[(view.axis + 2) % 3] = at(j);
      items_.push_back({item, direction});
    }
  }
}

void ItemViews::draw_views(double near, const VisibleSet& wanted) {
  for (std::size_t v = 0; v < kViews.size(); ++v) {
    if (triangles_[v].empty()) continue;
    read(kViews[v], buffer_.draw(kViews[v], static_cast<float>(near), triangles_[v]), wanted);
    cost_.triangles += triangles_[v].size() / 3;
    cost_.pixels += static_cast<std::uint64_t>(buffer_.side_px()) * buffer_.side_px();
  }
}

const std::vector<SightCandidate>& ItemViews::look(const Vec3& eye, double near_m,
                                                   const VisibleSet& drawn,
                                                   const VisibleSet& wanted) {
  items_.clear();
  cost_ = {};
  for (auto& list : triangles_) list.clear();
  const double near = std::max(near_m, kNearest * length(scene_->bounds().size()));
  gather(eye, drawn, false);
  draw_views(near, wanted);
  if (!has_passable_) return items_;
  gather(eye, drawn, true);  // before what is opaque, each as far as nothing passable is nearer
  draw_views(near, wanted);
  return items_;
}

}  // namespace pvsfarm
