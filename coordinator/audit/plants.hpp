// The audit's own test: objects that are plainly visible are taken out of a few cells' sets, and
// the audit must find every one of them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/pvs/inquiry.hpp"
#include "common/pvs/store_reader.hpp"

namespace pvsfarm {

struct Plant {
  std::uint32_t cell = 0;
  ObjectId object{};
};

// Answers questions in their order; an empty finding (no key) where one was not answered.
using AskAudits = std::function<Result<std::vector<AuditFinding>>(const std::vector<Question>&)>;

// `count` leaf cells, drawn from `seed`, and in each one of the objects that are in its set and
// that each of four looks around meets, of 250 rays each: so it fills about a hundredth of the
// view, or more. Fewer, if so many cells do not see anything so plainly. `ask` is used once.
// Errors: kInvalidInput (damaged store), those of `ask`.
Result<std::vector<Plant>> choose_plants(StoreReader& store, std::size_t count, std::uint64_t seed,
                                         const AskAudits& ask);

}  // namespace pvsfarm
