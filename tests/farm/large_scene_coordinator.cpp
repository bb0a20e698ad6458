// A coordinator of a scene that is as large as asked, though quick to import and to evaluate: the
// rest of its bundle is names that nobody looks at, and no byte of them tells of its neighbours.
//   large_scene_coordinator SCENE CELLS TAGS BYTES OUT ENDPOINT
// Prints the number of cells that it had evaluated. Ends as `pvsfarm coordinate` does.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "common/base/random.hpp"
#include "common/scene/bundle.hpp"
#include "common/scene/import.hpp"
#include "common/scene/scene_build.hpp"
#include "coordinator/service/bake.hpp"

namespace pvsfarm {
namespace {

Result<std::shared_ptr<const Scene>> padded(std::vector<std::byte> bundle, std::uint64_t bytes) {
  const Result<BundleParts> parts = read_bundle(bundle);
  if (!parts) return parts.error();
  std::vector<char> names(parts->names.begin(), parts->names.end());
  std::size_t at = names.size();
  if (bytes > bundle.size()) names.resize(names.size() + (bytes - bundle.size()));
  Random random(1);
  for (; at + 8 <= names.size(); at += 8) {
    const std::uint64_t word = random.next();
    std::memcpy(&names[at], &word, 8);
  }
  BundleParts larger = *parts;
  larger.names = names;
  return Scene::from_bytes(write_bundle(larger));
}

Status run(char** argv) {
  auto imported = import_scene({.scene_path = argv[1], .tags_path = argv[3]});
  if (!imported) return imported.error();
  auto bundle = build_bundle(std::move(imported->source));
  if (!bundle) return bundle.error();
  auto scene = padded(std::move(bundle).value(), std::strtoull(argv[4], nullptr, 10));
  if (!scene) return scene.error();
  auto roots = read_cells(argv[2]);
  if (!roots) return roots.error();
  // As the bakes of FarmFixture.
  BakeJob job{.scene = std::move(scene).value(),
              .roots = std::move(roots).value(),
              .settings = {},
              .output = argv[5]};
  job.settings.subdivision.budget_triangles = job.settings.evaluator.budget_triangles = 605;
  job.settings.subdivision.min_cell_m = 0.7;
  const auto say = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  const auto summary = bake(std::move(job), {.endpoint = argv[6], .local_workers = 0},
                            {.note = say, .warning = say});
  if (!summary) return summary.error();
  std::printf("%lu\n", static_cast<unsigned long>(summary->evaluated));
  return {};
}

}  // namespace
}  // namespace pvsfarm

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  const pvsfarm::Status status = pvsfarm::run(argv);
  if (status) return 0;
  std::fprintf(stderr, "%s\n", status.error().text.c_str());
  return static_cast<int>(status.error().kind);
}
