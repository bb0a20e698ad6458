// From triangles to the bundle: objects in Morton order, the hierarchy of their boxes, and the
// occluder models, each only where theory 0.2 allows it.
#pragma once

#include <cstddef>
#include <vector>

#include "common/base/result.hpp"
#include "common/scene/scene.hpp"
#include "common/scene/scene_source.hpp"

namespace pvsfarm {

// The bytes of the bundle. The same source gives the same bytes on every machine.
// Errors: kInvalidInput (no objects, no occludees, a NaN or infinite vertex, an index out of range,
// a limit passed), naming the object and how to mend it.
// Takes the source, which may be as large as the bundle, and gives it up object by object.
Result<std::vector<std::byte>> build_bundle(SceneSource source);

// build_bundle and Scene::from_bytes in one.
Result<std::shared_ptr<const Scene>> build_scene(SceneSource source);

}  // namespace pvsfarm
