#include "coordinator/merger/round_figures.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace pvsfarm {
namespace {

std::string number(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

void put(std::string& out, const char* name, const std::string& value) {
  out += std::string(",\"") + name + "\":" + value;
}

void put_pair(std::string& out, const char* name, std::uint64_t objects, std::uint64_t triangles) {
  if (objects == 0 && triangles == 0) return;
  put(out, name, '[' + std::to_string(objects) + ',' + std::to_string(triangles) + ']');
}

}  // namespace

void RoundSums::add(const RoundFigures& f) {
  const auto same = [&](const RoundFigures& other) {
    return other.method == f.method && other.turn == f.turn;
  };
  const auto found = std::find_if(sums_.begin(), sums_.end(), same);
  if (found == sums_.end()) {
    sums_.push_back(f);
    return;
  }
  RoundFigures& sum = *found;
  if (f.planes > 0)
    sum.nearest_m = sum.planes > 0 ? std::min(sum.nearest_m, f.nearest_m) : f.nearest_m;
  sum.cells += f.cells;
  sum.planes += f.planes;
  sum.occluders += f.occluders;
  sum.resolution_px = std::max(sum.resolution_px, f.resolution_px);
  sum.farthest_m = std::max(sum.farthest_m, f.farthest_m);
  sum.extent = std::max(sum.extent, f.extent);
  sum.open_objects += f.open_objects;
  sum.open_triangles += f.open_triangles;
  sum.hidden_objects += f.hidden_objects;
  sum.seen_objects += f.seen_objects;
  sum.hidden_triangles += f.hidden_triangles;
  sum.seen_triangles += f.seen_triangles;
  sum.work += f.work;
  sum.cpu_ms += f.cpu_ms;
}

void RoundSums::add(std::span<const CascadeRound> rounds) {
  std::array<std::uint32_t, kMethodCount> turns{};
  for (const CascadeRound& r : rounds)
    add({.method = r.method,
         .turn = turns[static_cast<std::size_t>(r.method)]++,
         .cells = 1,
         .planes = r.maps.planes,
         .occluders = r.maps.occluders,
         .resolution_px = r.maps.resolution_px,
         .nearest_m = r.maps.nearest_m,
         .farthest_m = r.maps.farthest_m,
         .extent = r.maps.extent,
         .open_objects = r.open_objects,
         .open_triangles = r.open_triangles,
         .hidden_objects = r.hidden_objects,
         .seen_objects = r.seen_objects,
         .hidden_triangles = r.hidden_triangles,
         .seen_triangles = r.seen_triangles,
         .work = r.work,
         .cpu_ms = r.cpu_ms});
}

void RoundSums::add(const RoundSums& other) {
  for (const RoundFigures& figures : other.sums_) add(figures);
}

std::string json_of(const RoundFigures& r) {
  std::string out = std::string("{\"method\":\"") + to_string(r.method) + '"';
  if (r.cells > 1) put(out, "cells", std::to_string(r.cells));
  put_pair(out, "open", r.open_objects, r.open_triangles);
  put_pair(out, "hidden", r.hidden_objects, r.hidden_triangles);
  put_pair(out, "seen", r.seen_objects, r.seen_triangles);
  put(out, "work", std::to_string(r.work));
  if (r.cpu_ms > 0) put(out, "ms", number(r.cpu_ms, 3));
  if (r.planes > 0) put(out, "planes", std::to_string(r.planes));
  if (r.resolution_px > 0) put(out, "px", std::to_string(r.resolution_px));
  if (r.occluders > 0) put(out, "occluders", std::to_string(r.occluders));
  if (r.planes > 0) {
    put(out, "from_m", number(r.nearest_m, 2));
    put(out, "to_m", number(r.farthest_m, 2));
    put(out, "extent", number(r.extent, 2));
  }
  return out + '}';
}

}  // namespace pvsfarm
