#include "coordinator/cli/audit_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "coordinator/cli/progress_line.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kShownViolations = 100, kShownCells = 5;

// Names are read once, places when they are shown.
class Words {
 public:
  static Result<Words> make(StoreReader& store) {
    auto objects = store.objects();
    if (!objects) return objects.error();
    return Words(store, std::move(objects).value());
  }

  std::string_view object(ObjectId id) const { return objects_[index_of(id)].name; }
  Vec3 in_file(const Vec3& p) const { return file_from_internal(store_->header().up, p) + 0.0; }
  // "cell 12 (root 7, path 01)"
  std::string cell(std::uint32_t index) {
    const StoredNode node = look_up(index);
    const std::string path = path_text(node.key);
    return "cell " + std::to_string(index) + " (root " + std::to_string(node.root_id) +
           (path.empty() ? "" : ", path " + path) + ")";
  }
  Json cell_json(std::uint32_t index) {
    const StoredNode node = look_up(index);
    return {{"cell", index}, {"root", node.root_id}, {"path", path_text(node.key)}};
  }
  const Status& status() const { return status_; }

 private:
  Words(StoreReader& store, std::vector<StoreObject> objects)
      : store_(&store), objects_(std::move(objects)) {}

  StoredNode look_up(std::uint32_t index) {
    auto node = store_->node(index);
    if (node) return *node;
    status_ = node.error();
    return {};
  }

  StoreReader* store_;
  std::vector<StoreObject> objects_;
  Status status_;
};

std::string percent(double share) { return fixed(100 * share, 1) + " %"; }

void add_cells(std::string& out, const char* title, const std::vector<CellGap>& gaps,
               std::size_t first, std::size_t count, Words& words) {
  out += std::string(title) + ":\n";
  for (std::size_t i = first; i < first + count; ++i)
    out += "  " + words.cell(gaps[i].cell) + ": gap " + percent(gaps[i].gap()) + ", " +
           grouped(gaps[i].seen_triangles) + " of " +
           counted(gaps[i].triangles, "triangle", "triangles") + " certainly seen\n";
}

void add_violations(std::string& out, const AuditReport& report, Words& words) {
  const std::size_t shown = std::min(report.violations.size(), kShownViolations);
  for (std::size_t i = 0; i < shown; ++i) {
    const FoundViolation& v = report.violations[i];
    out += "VIOLATION: " + words.cell(v.cell) + " sees " + std::string(words.object(v.object)) +
           ", which its set lacks: from " + point_text(words.in_file(v.line.eye)) + " to " +
           point_text(words.in_file(v.line.point)) + '\n';
  }
  if (shown < report.violations.size())
    out += "and " + grouped(report.violations.size() - shown) + " more\n";
}

}  // namespace

bool AuditReport::found(const Plant& plant) const {
  return std::any_of(violations.begin(), violations.end(), [&](const FoundViolation& v) {
    return v.cell == plant.cell && v.object == plant.object;
  });
}

std::size_t AuditReport::plants_found() const {
  return static_cast<std::size_t>(std::count_if(plants.begin(), plants.end(),
                                                [&](const Plant& plant) { return found(plant); }));
}

Result<std::string> audit_text(const AuditReport& report, StoreReader& store) {
  Result<Words> words = Words::make(store);
  if (!words) return words.error();
  const AuditFigures& f = report.figures;
  std::string out = report.store + ": " + grouped(f.leaves_reached) + " of " +
                    counted(f.leaves, "leaf cell", "leaf cells") + " audited";
  if (f.inner > 0)
    out += ", " + grouped(f.inner_reached) + " of " + counted(f.inner, "inner one", "inner ones");
  out += ", " + grouped(f.rays) + " rays, " +
         counted(static_cast<std::uint64_t>(f.passes), "whole pass", "whole passes") + ", " +
         duration_text(report.seconds) + '\n';
  if (f.given_up > 0) out += counted(f.given_up, "audit", "audits") + " could not be carried out\n";
  add_violations(out, report, *words);
  for (const Plant& plant : report.plants)
    out += std::string(report.found(plant) ? "planted, found: " : "planted, MISSED: ") +
           words->cell(plant.cell) + ", " + std::string(words->object(plant.object)) + '\n';
  if (report.violations.empty()) out += "no violation found\n";
  out += "objects of their sets that the bake had not certified and the audit saw: " +
         grouped(report.newly_seen) + '\n';
  const std::size_t shown = std::min(report.gaps.size(), kShownCells);
  if (shown > 0) {
    add_cells(out, "tightest cells", report.gaps, 0, shown, *words);
    add_cells(out, "loosest cells", report.gaps, report.gaps.size() - shown, shown, *words);
  }
  if (!words->status()) return words->status().error();
  return out;
}

Result<std::string> audit_json(const AuditReport& report, StoreReader& store) {
  Result<Words> words = Words::make(store);
  if (!words) return words.error();
  const auto point = [&](const Vec3& p) {
    const Vec3 q = words->in_file(p);
    return Json{q.x, q.y, q.z};
  };
  Json violations = Json::array(), plants = Json::array();
  for (const FoundViolation& v : report.violations) {
    Json entry = words->cell_json(v.cell);
    entry["object"] = words->object(v.object);
    entry["eye"] = point(v.line.eye);
    entry["point"] = point(v.line.point);
    violations.push_back(std::move(entry));
  }
  for (const Plant& plant : report.plants) {
    Json entry = words->cell_json(plant.cell);
    entry["object"] = words->object(plant.object);
    entry["found"] = report.found(plant);
    plants.push_back(std::move(entry));
  }
  const auto cells = [&](std::size_t first, std::size_t count) {
    Json list = Json::array();
    for (std::size_t i = first; i < first + count; ++i) {
      Json entry = words->cell_json(report.gaps[i].cell);
      entry["gap"] = report.gaps[i].gap();
      entry["triangles"] = report.gaps[i].triangles;
      entry["seen_triangles"] = report.gaps[i].seen_triangles;
      list.push_back(std::move(entry));
    }
    return list;
  };
  const AuditFigures& f = report.figures;
  const std::size_t shown = std::min(report.gaps.size(), kShownCells);
  const Json out{{"store", report.store},
                 {"leaves", f.leaves},
                 {"leaves_reached", f.leaves_reached},
                 {"inner", f.inner},
                 {"inner_reached", f.inner_reached},
                 {"passes", f.passes},
                 {"questions", f.questions},
                 {"given_up", f.given_up},
                 {"rays", f.rays},
                 {"seconds", report.seconds},
                 {"interrupted", report.interrupted},
                 {"violations", violations},
                 {"planted", plants},
                 {"newly_seen", report.newly_seen},
                 {"tightest", cells(0, shown)},
                 {"loosest", cells(report.gaps.size() - shown, shown)}};
  if (!words->status()) return words->status().error();
  return out.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace pvsfarm
