#include "coordinator/merger/store_build.hpp"

#include <cstdio>

#include "common/base/check.hpp"
#include "coordinator/merger/merger.hpp"

namespace pvsfarm {
namespace {

std::string statistics_line(std::uint64_t node, const SubtreeNode& part) {
  const auto number = [](double ms) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", ms);
    return std::string(text);
  };
  const auto pair = [](std::uint64_t objects, std::uint64_t triangles) {
    return "[" + std::to_string(objects) + "," + std::to_string(triangles) + "]";
  };
  std::string line = "{\"cell\":" + std::to_string(node) + ",\"ms\":" + number(part.cost.cpu_ms);
  if (part.parts > 0) line += ",\"parts\":" + std::to_string(part.parts);
  if (part.cost.contradictions > 0)
    line += ",\"contradictions\":" + std::to_string(part.cost.contradictions);
  std::string methods;
  for (int i = 0; i < kMethodCount; ++i) {
    const MethodFigures& m = part.cost.methods[static_cast<std::size_t>(i)];
    if (m.work == 0 && m.hidden_objects == 0 && m.seen_objects == 0) continue;
    methods += methods.empty() ? "\"" : ",\"";
    methods += std::string(to_string(static_cast<Method>(i))) +
               "\":{\"hidden\":" + pair(m.hidden_objects, m.hidden_triangles) +
               ",\"seen\":" + pair(m.seen_objects, m.seen_triangles) +
               ",\"work\":" + std::to_string(m.work) + ",\"ms\":" + number(m.cpu_ms) + "}";
  }
  if (!methods.empty()) line += ",\"methods\":{" + methods + "}";
  std::string rounds;
  for (const RoundFigures& round : part.cost.rounds.all())
    rounds += (rounds.empty() ? "" : ",") + json_of(round);
  if (!rounds.empty()) line += ",\"rounds\":[" + rounds + "]";
  return line + "}\n";
}

}  // namespace

StoreBuild::StoreBuild(const Tree& tree, std::vector<std::int64_t> root_ids, StoreWriter& writer,
                       HintsWriter* hints)
    : tree_(tree), root_ids_(std::move(root_ids)), writer_(writer), hints_(hints) {
  PVS_CHECK_EQ(root_ids_.size(), tree_.root_count());
}

// False: there are no more nodes.
bool StoreBuild::next_expected(Expected& out) {
  if (!expected_.empty()) {
    out = std::move(expected_.back());
    expected_.pop_back();
  } else if (next_root_ < tree_.root_count()) {
    const CellKey key{next_root_++, 1};
    out = {key, *tree_.cell(key), tree_.occludees()};
  } else {
    return false;
  }
  return true;
}

Status StoreBuild::take(Expected expected, const ResultRow* row) {
  SubtreeNode part{.node = {.key = expected.key,
                            .root_id = root_ids_[expected.key.root],
                            .reason = LeafReason::kGivenUp,
                            .quarantined = row == nullptr,
                            .cell = expected.cell,
                            .visible = {},
                            .seen = {}},
                   .visible = {},
                   .seen = {},
                   .cost = {}};
  VisibleSet visible = std::move(expected.parent);
  VisibleSet seen = VisibleSet::none(tree_.object_count());
  if (row != nullptr) {
    Result<CellDelta> delta = decode_row(*row, tree_.object_count());
    if (!delta) return delta.error();
    visible.remove_all(delta->hidden);
    seen = std::move(delta->seen);
    part.node.reason = leaf_reason(
        {part.node.cell, part.node.key.depth(), tree_.triangles(visible), row->point_triangles},
        tree_.subdivision());
    part.node.leaf = part.node.reason != LeafReason::kNone;
    if (hints_ != nullptr) part.hints = row->hints;
    part.cost.add(row->statistics);
    figures_.cost.add(row->statistics);
    ++figures_.evaluated;
  }
  part.visible = encode(visible);
  part.seen = encode(seen);
  const StoreNode& node = part.node;
  if (!node.leaf) {
    auto [low, high] = split(node.cell, node.cell.longest_axis());
    expected_.push_back({node.key.child(1), high, visible});
    expected_.push_back({node.key.child(0), low, std::move(visible)});
  }
  subtree_.push_back(std::move(part));
  return expected_.empty() ? finish_root() : Status();
}

Status StoreBuild::finish_root() {
  merge_siblings(tree_, subtree_);
  for (SubtreeNode& part : subtree_)
    if (Status status = write(part); !status) return status;
  subtree_.clear();
  return {};
}

Status StoreBuild::write_hints(const SubtreeNode& part) {
  if (hints_ == nullptr) return {};
  if (!part.node.leaf) return hints_->add({});
  const std::size_t objects = part.node.visible.count();
  return hints_->add(part.hints.empty() ? unknown_hints(objects) : part.hints);
}

Status StoreBuild::write(SubtreeNode& part) {
  StoreNode& node = part.node;
  for (const auto& [bytes, set] :
       {std::pair{&part.visible, &node.visible}, {&part.seen, &node.seen}}) {
    Result<VisibleSet> unpacked = decode_visible_set(*bytes, tree_.object_count());
    PVS_CHECK(unpacked.ok());  // our own encoding
    *set = std::move(unpacked).value();
  }
  if (Status status = writer_.add(node); !status) return status;
  if (Status status = write_hints(part); !status) return status;
  lines_ += statistics_line(figures_.nodes, part);
  ++figures_.nodes;
  figures_.merged_parts += part.parts;
  figures_.refuted += part.refuted;
  if (node.quarantined) ++figures_.quarantined;
  if (!node.leaf) return {};
  const std::uint64_t objects = node.visible.count(), seen = node.seen.count();
  const std::uint64_t triangles = tree_.triangles(node.visible);
  const std::uint64_t seen_triangles = tree_.triangles(node.seen);
  ++figures_.leaves;
  ++figures_.leaves_by_reason[static_cast<std::size_t>(node.reason)];
  figures_.leaf_objects += objects;
  figures_.leaf_triangles += triangles;
  figures_.seen_objects += seen;
  figures_.seen_triangles += seen_triangles;
  figures_.gap_of_objects += gap_of(objects, seen);
  figures_.gap_of_triangles += gap_of(triangles, seen_triangles);
  return {};
}

Status StoreBuild::add(const ResultRow& row) {
  for (;;) {
    Expected expected;
    if (!next_expected(expected) || expected.key > row.key)
      return invalid_input("the journal holds a cell that this bake does not have");
    const bool found = expected.key == row.key;
    if (Status status = take(std::move(expected), found ? &row : nullptr); !status) return status;
    if (found) return {};
  }
}

Status StoreBuild::finish() {
  for (;;) {
    Expected expected;
    if (!next_expected(expected)) return {};
    if (Status status = take(std::move(expected), nullptr); !status) return status;
  }
}

}  // namespace pvsfarm
