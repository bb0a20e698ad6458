// Finds in a store what has to be asked so that an object's absence, or presence, is explained.
//
// A store does not keep certificates: they are found again. What hides an object from a cell may
// belong to the cell itself, to a cell it was split from, or to the cells that were merged into it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/pvs/inquiry.hpp"
#include "common/pvs/settings.hpp"
#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

// Answers questions in their order, or fails.
using AskWorker =
    std::function<Result<std::vector<ExplainFinding>>(const std::vector<ExplainQuestion>&)>;

struct Explanation {
  StoredNode asked;
  ObjectId object{};
  bool visible = false;  // what the store says
  // Whose evaluation settled it: `asked`, or the first cell above it that does not see the object.
  StoredNode node;
  struct Piece {
    CellKey key;  // `node`, or below it
    Cell cell;
    ExplainFinding finding;
  };
  // One; or several, which tile `node`, where the object was found hidden only from parts of it:
  // those it was split into (an inner node's set is the union of its leaves', tighter than its own
  // evaluation), or those that were merged again afterwards.
  std::vector<Piece> pieces;
  // The evaluation agrees with the store. False: another version baked it, or something is broken.
  bool agrees = true;
};

// Requires: cell < node_count(), `object` an occludee. Errors: of the store, of `ask`.
Result<Explanation> explain_in_store(StoreReader& store, const SubdivisionSettings& subdivision,
                                     std::uint32_t cell, ObjectId object, const AskWorker& ask);

// The object called `text`: a name, or "#12" for the one with that number.
// Errors: kInvalidInput (no such object: names like it; several; one that only occludes).
Result<ObjectId> object_named(StoreReader& store, const std::string& text);

}  // namespace pvsfarm
