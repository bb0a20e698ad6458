#include "coordinator/cli/bake_summary.hpp"

#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "coordinator/cli/progress_line.hpp"
#include "coordinator/cli/text.hpp"

namespace pvsfarm {
namespace {

using Json = nlohmann::ordered_json;

double per(double sum, std::uint64_t count) {
  return count == 0 ? 0 : sum / static_cast<double>(count);
}
double per(std::uint64_t sum, std::uint64_t count) { return per(static_cast<double>(sum), count); }

// Calls f(name, figures, used) for each method in its order.
template <class F>
void for_each_method(const CostFigures& cost, Methods used, F&& f) {
  for (int i = 0; i < kMethodCount; ++i) {
    const auto method = static_cast<Method>(i);
    f(to_string(method), cost.methods[static_cast<std::size_t>(i)], used.has(method));
  }
}

bool idle(const MethodFigures& m) {
  return m.work == 0 && m.hidden_objects == 0 && m.seen_objects == 0;
}

std::string percent(double part) { return fixed(100 * part, 1) + " %"; }

void put_gap(std::ostream& out, const StoreFigures& s) {
  if (s.seen_objects == 0) {
    out << "gap: unknown: no object was looked for with a witness method\n";
    return;
  }
  out << "gap: " << percent(gap_of(s.leaf_triangles, s.seen_triangles)) << " of the triangles and "
      << percent(gap_of(s.leaf_objects, s.seen_objects))
      << " of the objects in the PVS are not certainly seen; mean of the leaves "
      << percent(per(s.gap_of_triangles, s.leaves)) << " and "
      << percent(per(s.gap_of_objects, s.leaves)) << "\n";
}

// What each method settled that none before it had, a cell.
void put_methods(std::ostream& out, const StoreFigures& s, Methods used) {
  bool any = false;
  for_each_method(s.cost, used, [&](const char* name, const MethodFigures& m, bool) {
    if (idle(m)) return;
    if (!any)
      out << "method, a cell     hidden: objects  triangles    seen: objects  triangles        "
             "ms\n";
    any = true;
    const auto put = [&](std::uint64_t sum, int width) {
      out << std::setw(width) << (sum == 0 ? "-" : fixed(per(sum, s.evaluated), 1));
    };
    out << "  " << std::left << std::setw(17) << name << std::right;
    put(m.hidden_objects, 15);
    put(m.hidden_triangles, 11);
    put(m.seen_objects, 17);
    put(m.seen_triangles, 11);
    out << std::setw(10) << fixed(per(m.cpu_ms, s.evaluated), 2) << '\n';
  });
}

std::string leaves_text(const StoreFigures& s) {
  std::string text;
  for (int i = 1; i < kLeafReasonCount; ++i) {
    const std::uint64_t count = s.leaves_by_reason[static_cast<std::size_t>(i)];
    if (count == 0) continue;
    text += (text.empty() ? "" : ", ") + grouped(count) + " " + words_for(LeafReason(i));
  }
  return text;
}

void put_not_computed(std::ostream& out, const StoreFigures& s, Methods used) {
  out << "leaves: " << leaves_text(s);
  if (s.merged_parts > 0)
    out << "; " << counted(s.merged_parts, "cell was", "cells were") << " merged into them";
  out << '\n';
  std::string left_out, not_needed;
  for_each_method(s.cost, used, [&](const char* name, const MethodFigures& m, bool is_used) {
    if (!is_used) left_out += (left_out.empty() ? "" : ", ") + std::string(name);
    if (is_used && idle(m)) not_needed += (not_needed.empty() ? "" : ", ") + std::string(name);
  });
  if (!left_out.empty()) out << "methods left out: " << left_out << '\n';
  if (!not_needed.empty()) out << "methods that were never begun: " << not_needed << '\n';
}

Json methods_json(const StoreFigures& s, Methods used) {
  Json methods = Json::object();
  for_each_method(s.cost, used, [&](const char* name, const MethodFigures& m, bool is_used) {
    if (!is_used) return;
    methods[name] = {{"hidden_objects", m.hidden_objects},
                     {"hidden_triangles", m.hidden_triangles},
                     {"seen_objects", m.seen_objects},
                     {"seen_triangles", m.seen_triangles},
                     {"work", m.work},
                     {"ms_per_cell", per(m.cpu_ms, s.evaluated)}};
  });
  return methods;
}

Json rounds_json(const StoreFigures& s) {
  Json rounds = Json::array();
  for (const RoundFigures& round : s.cost.rounds.all())
    rounds.push_back(Json::parse(json_of(round)));
  return rounds;
}

// What the cascades chose and what came of it, a cell that came to it.
void put_rounds(std::ostream& out, const StoreFigures& s) {
  out << "round, a cell       of cells    planes   open objects   hidden     seen        ms\n";
  for (const RoundFigures& r : s.cost.rounds.all()) {
    const std::string name = std::string(to_string(r.method)) + ' ' + std::to_string(r.turn + 1);
    out << "  " << std::left << std::setw(18) << name << std::right << std::setw(8)
        << fixed(100 * per(r.cells, s.evaluated), 1) << '%';
    const auto put = [&](double value, int width, int decimals) {
      out << std::setw(width) << fixed(value, decimals);
    };
    put(per(r.planes, r.cells), 9, 1);
    put(per(r.open_objects, r.cells), 15, 1);
    put(per(r.hidden_objects, r.cells), 9, 1);
    put(per(r.seen_objects, r.cells), 9, 1);
    put(per(r.cpu_ms, r.cells), 10, 2);
    out << '\n';
  }
}

Json leaves_json(const StoreFigures& s) {
  Json leaves = Json::object();
  for (int i = 1; i < kLeafReasonCount; ++i)
    leaves[to_string(LeafReason(i))] = s.leaves_by_reason[static_cast<std::size_t>(i)];
  return leaves;
}

Json left_out_json(const StoreFigures& s, Methods used) {
  Json names = Json::array();
  for_each_method(s.cost, used, [&](const char* name, const MethodFigures&, bool is_used) {
    if (!is_used) names.push_back(name);
  });
  return names;
}

}  // namespace

const char* words_for(LeafReason reason) {
  switch (reason) {
    case LeafReason::kNone:
      return "split";
    case LeafReason::kNoBudget:
      return "not to be split (no budget)";
    case LeafReason::kBudgetMet:
      return "within the budget";
    case LeafReason::kTooSmall:
      return "too small to split";
    case LeafReason::kPointOverBudget:
      return "where one viewpoint sees more than the budget";
    case LeafReason::kNothingToGain:
      return "where one viewpoint sees nearly all";
    case LeafReason::kGivenUp:
      return "given up, with their parents' sets";
    case LeafReason::kMerged:
      return "merged from halves that agree";
  }
  return "unknown";
}

std::string bake_summary_json(const std::string& output, const BakeSummary& s, Methods used) {
  const StoreFigures& store = s.store;
  const Json gap{{"triangles", gap_of(store.leaf_triangles, store.seen_triangles)},
                 {"objects", gap_of(store.leaf_objects, store.seen_objects)},
                 {"mean_triangles", per(store.gap_of_triangles, store.leaves)},
                 {"mean_objects", per(store.gap_of_objects, store.leaves)}};
  const Json json{{"output", output},
                  {"already_baked", s.already_baked},
                  {"cells", store.nodes},
                  {"leaves", store.leaves},
                  {"quarantined", store.quarantined},
                  {"disagreements", s.disagreements},
                  {"contradictions", s.contradictions},
                  {"evaluated", s.evaluated},
                  {"resumed", s.resumed},
                  {"mean_objects", s.mean_objects},
                  {"mean_triangles", s.mean_triangles},
                  {"culled_percent", s.culled_percent},
                  {"gap", store.seen_objects == 0 ? Json(nullptr) : gap},
                  {"leaves_by_reason", leaves_json(store)},
                  {"merged_cells", store.merged_parts},
                  {"methods", methods_json(store, used)},
                  {"rounds", rounds_json(store)},
                  {"methods_left_out", left_out_json(store, used)},
                  {"bytes", s.file_bytes},
                  {"seconds", s.seconds},
                  {"workers", s.workers},
                  {"worker_cpu_ms_per_cell", s.worker_cpu_ms_per_cell},
                  {"coordinator_cpu_ms_per_cell", s.coordinator_cpu_ms_per_cell}};
  return json.dump() + "\n";
}

std::string bake_summary_text(const std::string& output, const BakeSummary& s, Methods used,
                              int verbosity) {
  std::ostringstream out;
  out << output << ": " << counted(s.store.leaves, "leaf cell", "leaf cells") << " of "
      << grouped(s.store.nodes) << ", " << bytes_text(s.file_bytes) << '\n'
      << "mean PVS: " << fixed(s.mean_objects, 1) << " objects, " << fixed(s.mean_triangles, 1)
      << " triangles, " << fixed(s.culled_percent, 1) << " % culled\n";
  put_gap(out, s.store);
  put_methods(out, s.store, used);
  if (verbosity > 0) put_rounds(out, s.store);
  put_not_computed(out, s.store, used);
  out << "time: " << duration_text(s.seconds) << ", " << fixed(s.worker_cpu_ms_per_cell, 1)
      << " ms of CPU a cell";
  if (s.resumed > 0) out << ", " << counted(s.resumed, "cell", "cells") << " from the journal";
  out << '\n';
  if (s.disagreements > 0)
    out << "WORKERS DISAGREED on " << counted(s.disagreements, "cell", "cells")
        << ": a third run decided, see the log; their machines or programs differ\n";
  if (s.contradictions > 0)
    out << "A WITNESS REFUTED A CERTIFICATE " << counted(s.contradictions, "time", "times")
        << ": this is a bug of pvsfarm, please report it with the scene\n";
  if (verbosity > 0)
    out << "coordinator: " << fixed(s.coordinator_cpu_ms_per_cell, 3) << " ms of CPU a cell\n";
  return out.str();
}

}  // namespace pvsfarm
