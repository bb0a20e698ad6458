#include "common/pvs/occludees.hpp"

namespace pvsfarm {

VisibleSet all_occludees(const Scene& scene) {
  VisibleSet set = VisibleSet::all(scene.object_count());
  for (std::uint32_t i = 0; i < scene.object_count(); ++i)
    if (!scene.object(ObjectId{i}).occludee) set.remove(ObjectId{i});
  return set;
}

}  // namespace pvsfarm
