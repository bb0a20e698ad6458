#include "common/scene/import.hpp"

#include <algorithm>
#include <cmath>

#include "common/geometry/box.hpp"
#include "common/scene/mesh_file.hpp"
#include "common/scene/tags.hpp"

namespace pvsfarm {
namespace {

// [scene units] A float step this long at the scene's far end is worth a word.
constexpr double kCoarseStep = 0.005;

std::string digits(double value) {
  std::string text = std::to_string(value);
  return text.substr(0, text.find('.') + 4);
}

// Far from the origin a float cannot hold a door frame.
void warn_if_coarse(const ImportOptions& options, const MeshFile& file,
                    std::vector<std::string>& warnings) {
  double farthest = 0;
  for (const SourceObject& object : file.objects)
    for (const Vec3& p : object.vertices)
      farthest = std::max({farthest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const double step = farthest * 0x1p-23;
  if (step > kCoarseStep)
    warnings.push_back(options.scene_path + ": coordinates reach " + digits(farthest) +
                       ", where the importer's steps are " + digits(step) +
                       "; move the scene nearer to the origin");
}

std::vector<std::string> warnings_for(const ImportOptions& options, const MeshFile& file) {
  std::vector<std::string> warnings;
  if (file.objects.size() == 1)
    warnings.push_back(options.scene_path +
                       ": holds a single object, so it is visible everywhere or nowhere; export "
                       "one mesh node (OBJ: one `o`) a building, room or prop");
  if (file.animated_objects > 0)
    warnings.push_back(options.scene_path + ": " + std::to_string(file.animated_objects) +
                       " animated objects are taken as dynamic with the box of their rest pose; "
                       "export geometry that spans their motion");
  warn_if_coarse(options, file, warnings);
  return warnings;
}

}  // namespace

Result<ImportedScene> import_scene(const ImportOptions& options) {
  Result<MeshFile> file = read_mesh_file(options.scene_path, options.up);
  if (!file) return file.error();
  if (!options.tags_path.empty())
    if (const Status s = apply_tags(options.tags_path, file->objects); !s.ok()) return s.error();
  const auto is_occludee = [](const SourceObject& object) { return object.occludee; };
  if (std::none_of(file->objects.begin(), file->objects.end(), is_occludee))
    return invalid_input(options.scene_path +
                         ": no object is an occludee, so nothing could be "
                         "visible; tag at least one with \"occludee\": true");

  ImportedScene imported;
  imported.warnings = warnings_for(options, *file);
  imported.source = {std::move(file->objects), file->up};
  if (options.occluders_path.empty()) return imported;

  Result<MeshFile> occluders = read_mesh_file(options.occluders_path, options.up);
  if (!occluders) return occluders.error();
  for (SourceObject& object : occluders->objects) {
    object.occludee = false;
    imported.source.objects.push_back(std::move(object));
  }
  return imported;
}

}  // namespace pvsfarm
