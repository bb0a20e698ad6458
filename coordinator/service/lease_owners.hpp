// To whom this coordinator gave which lease: a result under another's lease is no result.
// Shape: a ring of the last 65,536; what is older has been forgotten.
// Threads: one.
#pragma once

#include <cstdint>
#include <vector>

#include "coordinator/board/board.hpp"

namespace pvsfarm {

class LeaseOwners {
 public:
  // Leases are numbered from `first` on, and no other coordinator numbers any with its upper half.
  explicit LeaseOwners(std::uint64_t first) : first_(first) {}

  // Requires: the next number.
  void given(BoardLease lease, WorkerId worker) {
    PVS_CHECK_EQ(static_cast<std::uint64_t>(lease), first_ + count_);
    if (count_ < kRemembered)
      ring_.push_back(worker);
    else
      ring_[count_ % kRemembered] = worker;
    ++count_;
  }

  enum class Claim {
    kOwn,
    kAnothers,            // given to another worker, or to nobody
    kForgotten,           // too long ago to know
    kOfOtherCoordinator,  // its number is none of ours
  };
  Claim claim(BoardLease lease, WorkerId worker) const {
    const auto number = static_cast<std::uint64_t>(lease);
    if (number >> 32 != first_ >> 32) return Claim::kOfOtherCoordinator;
    const std::uint64_t index = number - first_;
    if (index >= count_) return Claim::kAnothers;
    if (index + kRemembered < count_) return Claim::kForgotten;
    return ring_[index % kRemembered] == worker ? Claim::kOwn : Claim::kAnothers;
  }

 private:
  static constexpr std::uint64_t kRemembered = 65'536;
  std::uint64_t first_, count_ = 0;
  std::vector<WorkerId> ring_;
};

}  // namespace pvsfarm
