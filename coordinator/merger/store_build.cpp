#include "coordinator/merger/store_build.hpp"

#include <cstdio>

#include "common/base/check.hpp"
#include "coordinator/merger/merger.hpp"

namespace pvsfarm {

StoreBuild::StoreBuild(const Tree& tree, std::vector<std::int64_t> root_ids, StoreWriter& writer)
    : tree_(tree), root_ids_(std::move(root_ids)), writer_(writer) {
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

Status StoreBuild::emit(const Expected& expected, const ResultRow* row) {
  StoreNode node{.key = expected.key,
                 .root_id = root_ids_[expected.key.root],
                 .quarantined = row == nullptr,
                 .cell = expected.cell,
                 .visible = expected.parent,
                 .seen = VisibleSet::none(tree_.object_count())};
  if (row != nullptr) {
    Result<CellDelta> delta = decode_row(*row, tree_.object_count());
    if (!delta) return delta.error();
    node.visible.remove_all(delta->hidden);
    node.seen = std::move(delta->seen);
    node.leaf = leaf_reason({node.cell, node.key.depth(), tree_.triangles(node.visible),
                             row->point_triangles},
                            tree_.subdivision()) != LeafReason::kNone;
  }
  if (Status status = writer_.add(node); !status) return status;

  const double ms = row == nullptr ? 0 : row->statistics.cpu_ms;
  char line[64];
  std::snprintf(line, sizeof line, "{\"cell\":%llu,\"ms\":%.3f}\n",
                static_cast<unsigned long long>(figures_.nodes), ms);
  lines_ += line;
  ++figures_.nodes;
  figures_.cpu_ms += ms;
  if (row == nullptr) ++figures_.quarantined;
  if (row != nullptr) figures_.contradictions += row->statistics.contradictions;
  if (node.leaf) {
    ++figures_.leaves;
    figures_.leaf_objects += node.visible.count();
    figures_.leaf_triangles += tree_.triangles(node.visible);
    return {};
  }
  auto [low, high] = split(node.cell, node.cell.longest_axis());
  expected_.push_back({node.key.child(1), high, node.visible});
  expected_.push_back({node.key.child(0), low, std::move(node.visible)});
  return {};
}

Status StoreBuild::add(const ResultRow& row) {
  for (;;) {
    Expected expected;
    if (!next_expected(expected) || expected.key > row.key)
      return invalid_input("the journal holds a cell that this bake does not have");
    const bool found = expected.key == row.key;
    if (Status status = emit(expected, found ? &row : nullptr); !status) return status;
    if (found) return {};
  }
}

Status StoreBuild::finish() {
  for (;;) {
    Expected expected;
    if (!next_expected(expected)) return {};
    if (Status status = emit(expected, nullptr); !status) return status;
  }
}

}  // namespace pvsfarm
