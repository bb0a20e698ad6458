#include "coordinator/cli/explanation.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include "common/cells/cell.hpp"

namespace pvsfarm {
namespace {

constexpr int kMostLevelsMerged = 24;

// The cell, the cell it was split from, and so on: the root first.
Result<std::vector<StoredNode>> line_of_descent(StoreReader& store, std::uint32_t cell) {
  std::vector<StoredNode> line;
  for (std::int64_t i = cell; i >= 0; i = line.back().parent) {
    auto node = store.node(static_cast<std::uint32_t>(i));
    if (!node) return node.error();
    line.push_back(std::move(*node));
  }
  std::reverse(line.begin(), line.end());
  return line;
}

Result<VisibleSet> occludees_of(StoreReader& store) {
  const auto objects = store.objects();
  if (!objects) return objects.error();
  VisibleSet set = VisibleSet::all(store.object_count());
  for (std::uint32_t i = 0; i < objects->size(); ++i)
    if (!(*objects)[i].occludee) set.remove(ObjectId{i});
  return set;
}

// What the coordinator's tree does, short of the budget: a leaf that was merged was over it.
bool was_splittable(const Cell& cell, const SubdivisionSettings& subdivision) {
  const int axis = cell.longest_axis();
  return subdivision.budget_triangles > 0 && can_split(cell, axis) &&
         cell.hi[axis] - cell.lo[axis] >= 2 * subdivision.min_cell_m;
}

bool hides(const Explanation::Piece& piece) { return piece.finding.verdict == Verdict::kHidden; }

// The pieces, with the halves of those that do not hide the object in their places. `fresh`: what
// is to be asked about the halves.
std::vector<Explanation::Piece> halved(std::vector<Explanation::Piece> pieces, ObjectId object,
                                       std::vector<ExplainQuestion>& fresh) {
  std::vector<Explanation::Piece> out;
  for (Explanation::Piece& piece : pieces) {
    if (hides(piece)) {
      out.push_back(std::move(piece));
      continue;
    }
    const auto [low, high] = split(piece.cell, piece.cell.longest_axis());
    for (int half = 0; half < 2; ++half) {
      out.push_back({.key = piece.key.child(half), .cell = half == 0 ? low : high});
      fresh.push_back({.key = out.back().key,
                       .cell = out.back().cell,
                       .parent = piece.finding.visible,
                       .object = object});
    }
  }
  return out;
}

// Goes down from the pieces that do not hide the object into their halves, level by level. Takes
// what it finds into `out` only if in the end all pieces hide it.
Status descend(const SubdivisionSettings& subdivision, const AskWorker& ask, Explanation& out) {
  std::vector<Explanation::Piece> pieces = out.pieces;
  for (int level = 0; level < kMostLevelsMerged; ++level) {
    if (std::all_of(pieces.begin(), pieces.end(), hides)) {
      out.pieces = std::move(pieces);
      out.agrees = true;
      return {};
    }
    for (const Explanation::Piece& piece : pieces)
      if (!hides(piece) && !was_splittable(piece.cell, subdivision)) return {};
    std::vector<ExplainQuestion> questions;
    pieces = halved(std::move(pieces), out.object, questions);
    auto findings = ask(questions);
    if (!findings) return findings.error();
    for (std::size_t i = 0; i < questions.size(); ++i)
      for (Explanation::Piece& piece : pieces)
        if (piece.key == questions[i].key) piece.finding = std::move((*findings)[i]);
  }
  return {};
}

// Levenshtein's distance, of the first kLongest letters.
std::size_t distance(std::string_view a, std::string_view b) {
  constexpr std::size_t kLongest = 64;
  a = a.substr(0, kLongest), b = b.substr(0, kLongest);
  std::array<std::size_t, kLongest + 1> row;
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t corner = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = corner + (a[i - 1] == b[j - 1] ? 0 : 1);
      corner = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::string names_like(const std::string& text, const std::vector<StoreObject>& objects) {
  constexpr std::size_t kMost = 3;
  std::vector<std::pair<std::size_t, std::string_view>> near;
  for (const StoreObject& object : objects)
    if (object.occludee) near.emplace_back(distance(text, object.name), object.name);
  const std::size_t count = std::min(kMost, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
  std::string out;
  for (std::size_t i = 0; i < count; ++i)
    out += (i == 0 ? "" : i + 1 == count ? " or " : ", ") + std::string(near[i].second);
  return out;
}

Result<ObjectId> checked(StoreReader& store, const std::vector<StoreObject>& objects,
                         std::uint32_t id) {
  if (objects[id].occludee) return ObjectId{id};
  return invalid_input(store.path() + ": " + std::string(objects[id].name) +
                       " only occludes: it is in no visible set");
}

}  // namespace

Result<Explanation> explain_in_store(StoreReader& store, const SubdivisionSettings& subdivision,
                                     std::uint32_t cell, ObjectId object, const AskWorker& ask) {
  const auto line = line_of_descent(store, cell);
  if (!line) return line.error();
  auto parent = occludees_of(store);
  if (!parent) return parent.error();
  const auto stored = store.sets(cell);
  if (!stored) return stored.error();
  Explanation out{.asked = line->back(),
                  .object = object,
                  .visible = stored->visible.contains(object),
                  .node = line->back()};
  // As the bake did: what a cell leaves visible is what its halves begin with, and the store does
  // not keep it.
  for (const StoredNode& node : *line) {
    auto findings =
        ask({{.key = node.key, .cell = node.cell, .parent = std::move(*parent), .object = object}});
    if (!findings) return findings.error();
    out.node = node;
    out.pieces = {{node.key, node.cell, std::move(findings->front())}};
    if (hides(out.pieces[0]) || node.index == cell) break;
    *parent = out.pieces[0].finding.visible;
  }
  const bool hidden = hides(out.pieces[0]);
  out.agrees = hidden != out.visible || out.node.quarantined;
  if (!out.visible && !hidden)
    if (Status status = descend(subdivision, ask, out); !status) return status.error();
  return out;
}

Result<ObjectId> object_named(StoreReader& store, const std::string& text) {
  const auto objects = store.objects();
  if (!objects) return objects.error();
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < objects->size(); ++i)
    if ((*objects)[i].name == text) found.push_back(i);
  if (found.size() == 1) return checked(store, *objects, found[0]);
  if (found.size() > 1) {
    std::string numbers;
    for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 8); ++i)
      numbers += " #" + std::to_string(found[i]);
    return invalid_input(store.path() + ": " + std::to_string(found.size()) +
                         " objects are called " + text + "; ask by number:" + numbers);
  }
  std::uint32_t id = 0;
  const char* const end = text.data() + text.size();
  if (text.size() > 1 && text[0] == '#' && std::from_chars(text.data() + 1, end, id).ptr == end &&
      id < objects->size())
    return checked(store, *objects, id);
  return invalid_input(store.path() + ": no object is called " + text + "; did you mean " +
                       names_like(text, *objects) + "?");
}

}  // namespace pvsfarm
