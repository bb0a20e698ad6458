// Occluders while a bundle is built: the three arrays of scene.hpp, growing.
#pragma once

#include <span>
#include <vector>

#include "common/scene/scene.hpp"

namespace pvsfarm {

struct OccluderSet {
  std::vector<Occluder> occluders;
  std::vector<Vec3> points;
  std::vector<ObjectId> owners;

  // Fills in box and ranges of `kind`, whose other fields are the caller's. Returns its index.
  std::int32_t add(Occluder kind, std::span<const Vec3> its_points,
                   std::span<const ObjectId> its_owners) {
    kind.box = {};
    for (const Vec3& p : its_points) kind.box.add(p);
    kind.first_point = points.size();
    kind.point_count = static_cast<std::uint32_t>(its_points.size());
    kind.first_owner = owners.size();
    kind.owner_count = static_cast<std::uint32_t>(its_owners.size());
    points.insert(points.end(), its_points.begin(), its_points.end());
    owners.insert(owners.end(), its_owners.begin(), its_owners.end());
    occluders.push_back(kind);
    return static_cast<std::int32_t>(occluders.size() - 1);
  }
};

}  // namespace pvsfarm
