#include "coordinator/cli/explain_text.hpp"

#include <cmath>

#include "coordinator/cli/file_cell.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

std::string percent(double share) {
  if (share == 1) return "all";
  return share > 0.999 ? "more than 99.9 %" : fixed(100 * share, 1) + " %";
}

// Three significant digits: "0.12 m", "41.2 m", "1230 m".
std::string metres(double value) {
  const int decimals =
      value >= 99.95 || value == 0 ? 0 : 2 - static_cast<int>(std::floor(std::log10(value)));
  return value < 1e-4 && value > 0 ? "less than 0.0001 m"
                                   : fixed(value, std::min(decimals, 4)) + " m";
}

// "-x" where it is an axis of the file.
std::string direction(const Vec3& d) {
  constexpr const char* kNames[3] = {"x", "y", "z"};
  for (int a = 0; a < 3; ++a)
    if (std::abs(d[a]) > 1 - kAxisTolerance) return std::string(d[a] > 0 ? "+" : "-") + kNames[a];
  return '(' + point_text(d) + ')';
}

class Writer {
 public:
  Writer(const Explanation& explanation, UpAxis up, const std::vector<StoreObject>& objects)
      : e_(explanation), up_(up), objects_(objects), name_(objects[index_of(e_.object)].name) {}

  std::string take() {
    headline();
    for (std::size_t i = 0; i < e_.pieces.size(); ++i) {
      if (e_.pieces.size() > 1) piece_title(i);
      finding(e_.pieces[i].finding);
      rounds(e_.pieces[i].finding.rounds);
    }
    disagreement();
    return std::move(out_);
  }

 private:
  void line(const std::string& text) { out_ += text + '\n'; }
  std::string at(const Vec3& p) const { return '(' + point_text(file_from_internal(up_, p)) + ')'; }

  void headline() {
    const std::string cell = "cell " + std::to_string(e_.asked.index);
    const Verdict verdict = e_.pieces[0].finding.verdict;
    if (!e_.visible)
      line(name_ + " is hidden from " + cell + '.');
    else if (verdict == Verdict::kSeen)
      line(name_ + " is seen from " + cell + '.');
    else
      line(name_ + " is in the PVS of " + cell +
           ": no plane hides it, and no line of sight was found.");
    if (e_.node.quarantined)
      line(
          "The bake could not evaluate the cell: its parent's set stands in. This is what an "
          "evaluation says.");
    if (e_.node.index != e_.asked.index)
      line("The proof is that of cell " + std::to_string(e_.node.index) + ", " +
           counted(e_.asked.key.depth() - e_.node.key.depth(), "level", "levels") +
           " above, which holds " + cell + '.');
    if (e_.pieces.size() > 1)
      line(e_.node.leaf ? "The cell was merged of smaller ones, each with a proof of its own."
                        : "The cell was split: its parts have proofs of their own, it has none.");
  }

  void piece_title(std::size_t i) {
    const FileCell cell = file_cell(up_, e_.pieces[i].cell);
    line("\nPart " + std::to_string(i + 1) + " of the cell: centre (" + point_text(cell.center) +
         "), half (" + point_text(cell.half) + ").");
  }

  void finding(const ExplainFinding& f) {
    if (f.verdict == Verdict::kSeen) sight_line(f);
    if (f.verdict == Verdict::kHidden) certificate(f);
    if (f.verdict == Verdict::kOpen) nearest_plane(f);
  }

  void sight_line(const ExplainFinding& f) {
    line("A line of sight runs " + metres(length(f.line.point - f.line.eye)) + " from " +
         at(f.line.eye) + " to " + at(f.line.point) + ", found by " + to_string(f.method) + '.');
    if (f.found_afterwards) {
      line("The bake did not find it: rays cast for this answer did.");
      if (!f.parts.empty())
        line("Of what its views touch on the best plane, " + percent(f.parts[0].covered) +
             " is covered.");
    }
    if (f.passed.empty()) return;
    line("It passes");
    for (const PassedBy& passed : f.passed)
      line("  " + metres(passed.clearance_m) + " from " +
           std::string(objects_[index_of(passed.object)].name) + ", at " + at(passed.at));
  }

  void certificate(const ExplainFinding& f) {
    if (f.parts.size() > 1)
      line("No plane hides its box as a whole; " + std::to_string(f.parts.size()) +
           " parts of it are hidden, each on a plane of its own:");
    for (std::size_t i = 0; i < f.parts.size(); ++i) {
      const ExplainFinding::Part& part = f.parts[i];
      if (f.parts.size() > 1) {
        const Box box = file_box(up_, part.box);
        line("\nPart " + std::to_string(i + 1) + " of its box: (" + point_text(box.lo) + ") to (" +
             point_text(box.hi) + ").");
      } else if (part.objects > 1) {
        line("It was hidden together with " + counted(part.objects - 1, "neighbour", "neighbours") +
             ", by one box around them.");
      }
      plane(f, part);
    }
    line("");
    if (f.unblocked.empty()) {
      line("Checked with " + counted(f.lines_checked, "line", "lines") +
           " from the cell to the object: opaque triangles block them all.");
    } else {
      line("WRONG: of " + counted(f.lines_checked, "line", "lines") + " drawn to check it, " +
           std::to_string(f.unblocked.size()) +
           (f.unblocked.size() == kMaxUnblocked ? " or more" : "") +
           " meet nothing opaque, such as from " + at(f.unblocked[0].eye) + " to " +
           at(f.unblocked[0].point) + ". Please report this with the scene.");
    }
  }

  void plane(const ExplainFinding& f, const ExplainFinding::Part& part) {
    const PlanePlace& p = part.plane;
    const Vec3 away = file_from_internal(up_, p.away);
    const std::string side = std::to_string(p.resolution_px);
    if (p.resolution_px == 0)
      line("Part by part of cell and object, surfaces block every line between them (" +
           std::string(to_string(f.method)) + ").");
    else
      line("Seen through the cell's " + direction(away) + " face, on a plane " +
           metres(p.distance_m) + " before it, its views touch " +
           counted(static_cast<std::uint64_t>(part.pixels), "pixel", "pixels") + " of a map" +
           (f.method == Method::kSweep ? "" : " of " + side + " x " + side) + " (" +
           to_string(f.method) + ").");
    const std::string share = part.covered == 1 ? "all" : percent(part.covered);
    if (part.by_lines)
      line((p.resolution_px == 0 ? std::string() : "They are all covered. ") +
           "Of lines from the cell to it, these block " + share + ", whoever is met first:");
    else
      line(part.covered == 1 ? "Matter before it covers them all:"
                             : "Matter before it covers " + share + " of them:");
    double named = 0;
    for (const Blocker& blocker : part.blockers) {
      named += blocker.share;
      line("  " + fixed(100 * blocker.share, 1) + " %  " + names_of(blocker.owners, objects_));
    }
    if (part.covered - named > 5e-4)
      line("  " + fixed(100 * (part.covered - named), 1) + " %  others");
  }

  void nearest_plane(const ExplainFinding& f) {
    if (f.parts.empty()) {
      line("No plane of the evaluation lies wholly between cell and object.");
      return;
    }
    line("The plane that comes nearest to hiding it:");
    plane(f, f.parts[0]);
  }

  // What the evaluation tried of which the answer is part, and what came of it.
  void rounds(const std::vector<CascadeRound>& rounds) {
    if (rounds.empty()) return;
    line("\nThe cell was tried with, in turn:");
    for (const CascadeRound& r : rounds) {
      std::string text = "  " + std::string(to_string(r.method));
      text.resize(std::max<std::size_t>(text.size(), 18), ' ');
      text += " of " + counted(r.open_objects, "open object", "open objects");
      if (r.hidden_objects > 0) text += ", " + grouped(r.hidden_objects) + " hidden";
      if (r.seen_objects > 0) text += ", " + grouped(r.seen_objects) + " seen";
      if (r.hidden_objects + r.seen_objects == 0) text += ", none settled";
      if (r.maps.planes > 0)
        text += "; " + counted(r.maps.planes, "plane", "planes") + " of " +
                std::to_string(r.maps.resolution_px) + " pixels, " + metres(r.maps.nearest_m) +
                " to " + metres(r.maps.farthest_m);
      line(text);
    }
  }

  void disagreement() {
    if (e_.agrees) return;
    line(std::string("\nThe store says ") + (e_.visible ? "visible" : "hidden") +
         ", this evaluation does not: it was baked by another version, or something is broken. "
         "`pvsfarm validate` checks the file.");
  }

  const Explanation& e_;
  UpAxis up_;
  const std::vector<StoreObject>& objects_;
  std::string name_, out_;
};

}  // namespace

std::string names_of(const std::vector<ObjectId>& owners, const std::vector<StoreObject>& objects) {
  constexpr std::size_t kMost = 3;
  std::string text;
  const std::size_t shown = owners.size() > kMost ? kMost - 1 : owners.size();
  for (std::size_t i = 0; i < shown; ++i) {
    if (i > 0) text += i + 1 == owners.size() ? " and " : ", ";
    text += objects[index_of(owners[i])].name;
  }
  if (shown < owners.size())
    text += " and " + grouped(owners.size() - shown) + " more, joined";
  else if (shown > 1)
    text += ", joined";
  return text;
}

std::string text_of(const Explanation& explanation, UpAxis up,
                    const std::vector<StoreObject>& objects) {
  return Writer(explanation, up, objects).take();
}

}  // namespace pvsfarm
