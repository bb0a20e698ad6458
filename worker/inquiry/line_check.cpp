#include "worker/inquiry/line_check.hpp"

#include <algorithm>
#include <map>
#include <optional>

#include "common/base/random.hpp"

namespace pvsfarm {
namespace {

constexpr std::uint32_t kLines = 512;           // for the whole of a certificate
constexpr std::uint32_t kLeastLinesAPart = 64;  // but so many a part: every corner to every corner
constexpr std::uint32_t kEyes = 32;
constexpr std::uint64_t kSeed = 0x6c696e65;

// A point of the box, every other time on its border.
Vec3 point_in(const Vec3& lo, const Vec3& hi, Random& random) {
  Vec3 t;
  for (int a = 0; a < 3; ++a) t[a] = random.unit();
  if (random.below(2) == 0) {
    const auto axis = static_cast<int>(random.below(3));
    t[axis] = static_cast<double>(random.below(2));
  }
  return lo + (hi - lo) * t;
}

std::vector<Vec3> eyes_of(const Cell& cell, Random& random) {
  std::vector<Vec3> eyes;
  for (int k = 0; k < 8; ++k) eyes.push_back(cell.corner(k));
  while (eyes.size() < kEyes) eyes.push_back(cell.point(point_in(cell.lo, cell.hi, random)));
  return eyes;
}

// Whose matter the line meets first, or passes by most nearly if it meets none. The object's own
// hides nothing of it.
std::optional<ObjectId> blocker_of(const SightCheck& sight, const Sightline& line,
                                   ObjectId object) {
  const auto hit = sight.first_hit(line);
  if (hit && hit->object != object) return hit->object;
  const auto near = sight.nearest(line, object, 1);
  return near.empty() ? std::nullopt : std::optional(near[0].object);
}

// Of what shafts hide, which are tested by what triangles fill, lines end on a triangle; of an
// object that moves, anywhere in its box.
Vec3 target_of(const Scene& scene, ObjectId object, const Box& box, Random& random) {
  const auto triangles = scene.triangles(object);
  if (scene.object(object).dynamic != 0 || triangles.empty())
    return point_in(box.lo, box.hi, random);
  const Triangle& triangle = triangles[random.below(triangles.size())];
  double s = random.unit(), t = random.unit();
  if (s + t > 1) s = 1 - s, t = 1 - t;
  const auto corner = [&](int k) { return scene.vertices()[triangle.vertex[k]]; };
  return corner(0) + (corner(1) - corner(0)) * s + (corner(2) - corner(0)) * t;
}

// The most frequent first.
void name_blockers(const std::map<ObjectId, std::uint32_t>& counts, std::uint32_t lines,
                   ExplainFinding::Part& part) {
  part.blockers.clear();
  std::uint32_t blocked = 0;
  for (const auto& [owner, count] : counts) {
    part.blockers.push_back({{owner}, static_cast<double>(count) / lines});
    blocked += count;
  }
  std::stable_sort(part.blockers.begin(), part.blockers.end(),
                   [](const Blocker& a, const Blocker& b) { return a.share > b.share; });
  part.blockers.resize(std::min(part.blockers.size(), kMaxBlockers));
  part.covered = static_cast<double>(blocked) / lines;
}

}  // namespace

Box common_box(const Box& part, const Box& object) {
  Box out;
  for (int a = 0; a < 3; ++a) {
    out.lo[a] = std::clamp(part.lo[a], object.lo[a], object.hi[a]);
    out.hi[a] = std::clamp(part.hi[a], object.lo[a], object.hi[a]);
  }
  return out;
}

void check_by_lines(const Scene& scene, const SightCheck& sight, const ExplainQuestion& question,
                    ExplainFinding& finding) {
  if (finding.parts.empty()) return;
  Random random(kSeed);
  const std::vector<Vec3> eyes = eyes_of(question.cell, random);
  const double reach = length(question.cell.center() - sight.origin()) +
                       length(question.cell.half()) + sight.radius();
  const double margin = sight.margin_for(reach);
  const auto parts = static_cast<std::uint32_t>(finding.parts.size());
  const std::uint32_t lines = std::max(kLeastLinesAPart, (kLines + parts - 1) / parts);
  for (ExplainFinding::Part& part : finding.parts) {
    std::map<ObjectId, std::uint32_t> counts;
    const Box target = common_box(part.box, scene.object(question.object).box);
    for (std::uint32_t k = 0; k < lines; ++k) {
      const bool of_shafts = part.plane.resolution_px == 0;
      const bool to_corner = !of_shafts && k < kLeastLinesAPart;
      const Vec3 eye = eyes[to_corner ? k % 8 : k % kEyes];
      const Vec3 point = of_shafts   ? target_of(scene, question.object, target, random)
                         : to_corner ? target.corner(static_cast<int>(k / 8))
                                     : point_in(target.lo, target.hi, random);
      ++finding.lines_checked;
      if (sight.clear({eye, point}, question.object, margin)) {
        if (finding.unblocked.size() < kMaxUnblocked) finding.unblocked.push_back({eye, point});
      } else if (part.by_lines) {
        if (const auto by = blocker_of(sight, {eye, point}, question.object)) ++counts[*by];
      }
    }
    if (part.by_lines) name_blockers(counts, lines, part);
  }
}

}  // namespace pvsfarm
