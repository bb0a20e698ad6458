// Sets of objects that are too large for a task: they stay here, by digest, until their workers
// have fetched them.
// Threads: one.
#pragma once

#include <map>
#include <memory>

#include "common/wire/messages.hpp"
#include "coordinator/tree/tree.hpp"

namespace pvsfarm {

class SetShelf {
 public:
  // How `set` (null: every occludee) travels in a message that holds `inline_bytes` of sets so far,
  // which is brought up to date. The shelf does not keep the set alive: its owner does.
  ParentSet place(const SharedSet& set, std::size_t& inline_bytes);
  SharedSet find(const Digest& digest) const;  // null: not here (any more)

 private:
  // Equal sets may have several owners: each keeps its own alive.
  std::multimap<Digest, std::weak_ptr<const Bytes>> sets_;
};

}  // namespace pvsfarm
