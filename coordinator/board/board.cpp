#include "coordinator/board/board.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {
constexpr double kMeanWeight = 0.05;  // of the newest cell in the moving mean
constexpr unsigned kMaxDoublings = 6;
constexpr std::uint64_t kQuantilesEvery = 32;  // cells, once there are many
}  // namespace

void Board::add(const CellKey& key) { fresh_.insert(key); }

void Board::add_again(const CellKey& key, WorkerId avoid) {
  trouble_[key].failed_on.insert(avoid);
  retries_.insert(key);
}

void Board::join(WorkerId id, unsigned slots, MachineId machine) {
  PVS_CHECK(workers_.count(id) == 0);
  Worker& worker = workers_[id];
  worker.slots = slots;
  worker.machine = machine;
  worker.first_time = id > newest_;
  worker.losses_before = machines_[machine].losses;
  newest_ = std::max(newest_, id);
  slots_ += slots;
}

void Board::stop_leasing(WorkerId id) {
  const auto found = workers_.find(id);
  if (found != workers_.end()) found->second.draining = true;
}

void Board::leave(WorkerId id, Parting parting, Millis now) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  const std::set<BoardLease> held = found->second.leases;
  unsigned running = found->second.slots;  // the first ones; the others waited
  for (const BoardLease lease : held) {
    const bool ran = running > 0;
    if (ran) --running;
    const Lease& of = leases_.at(lease);
    if (parting == Parting::kLost && ran && !of.cells.empty())
      note_lost(found->second, of.cells.front());
    fail(lease, parting == Parting::kLost && ran ? Failure::kTransient : Failure::kReturned, now);
  }
  slots_ -= found->second.slots;
  workers_.erase(found);
}

void Board::note_lost(const Worker& worker, const CellKey& at) {
  Machine& machine = machines_[worker.machine];
  // Of workers that were lost together only the first counts, and no worker that came back.
  if (!worker.first_time || worker.losses_before != machine.losses) return;
  ++machine.losses;
  machine.lost_at.insert(at);
  if (machine.lost_at.size() >= limits_.conduct.crash_loop)
    blocked_.push_back({{}, worker.machine, machine.lost_at.size()});
}

void Board::did_well(WorkerId id) {
  conduct_[id].completed();
  const auto worker = workers_.find(id);
  if (worker == workers_.end()) return;
  Machine& machine = machines_[worker->second.machine];
  machine.lost_at.clear();
}

void Board::block_if_due(WorkerId id, Conduct& conduct) {
  if (!conduct.blocked(limits_.conduct)) return;
  blocked_.push_back({id, {}, conduct.failures()});
  conduct = Conduct();
}

bool Board::adopt(WorkerId id, BoardLease lease, const std::vector<CellKey>& cells, Millis now) {
  const auto worker = workers_.find(id);
  if (worker == workers_.end() || leases_.count(lease) != 0) return false;
  std::vector<CellKey> mine;
  for (const CellKey& key : cells) {
    if (fresh_.erase(key) + retries_.erase(key) == 0) continue;
    mine.push_back(key);
    leased_[key] = lease;
  }
  if (mine.empty()) return false;
  Lease& of = leases_[lease];
  of = {.worker = id, .cells = mine, .size = mine.size()};
  of.granted = of.heard = of.advanced = now;
  worker->second.leases.insert(lease);
  next_look_ = std::min(next_look_, expiry(of));
  return true;
}

Millis Board::expiry(const Lease& lease) const {
  const Millis silence = lease.heard + limits_.lease;
  if (lease.computed) return silence;
  const int doubled = 1 << std::min(lease.attempt, kMaxDoublings);
  const auto at_least = [&](Millis least, Millis steps) {
    return std::max(least, steps) * doubled;
  };
  const Millis stall = lease.advanced + at_least(limits_.stall, limits_.stall_steps * p95_);
  if (!lease.began) return std::min(silence, stall);
  const auto cells = static_cast<std::int64_t>(lease.size);
  const Millis deadline =
      *lease.began + at_least(limits_.deadline, limits_.deadline_steps * cells * p95_);
  return std::min({silence, stall, deadline});
}

bool Board::renew(BoardLease id, std::uint64_t progress, Millis now) {
  const auto found = leases_.find(id);
  if (found == leases_.end() || found->second.expired) return false;
  Lease& lease = found->second;
  Worker& worker = workers_.at(lease.worker);
  lease.heard = now;
  if (progress > lease.progress) {
    lease.progress = progress;
    if (!lease.began) lease.began = now;
    lease.advanced = worker.advanced = now;
  } else if (progress == 0) {
    lease.advanced = std::max(lease.advanced, worker.advanced);
  }
  next_look_ = std::min(next_look_, expiry(lease));
  return true;
}

bool Board::renew_computed(BoardLease id, Millis now) {
  const auto found = leases_.find(id);
  if (found == leases_.end() || found->second.expired) return false;
  Lease& lease = found->second;
  lease.heard = lease.advanced = now;
  lease.computed = true;
  workers_.at(lease.worker).advanced = now;
  return true;
}

void Board::release_expired(WorkerId id, const std::set<BoardLease>& still) {
  const auto worker = workers_.find(id);
  if (worker == workers_.end()) return;
  const std::set<BoardLease> held = worker->second.leases;
  for (const BoardLease lease : held)
    if (leases_.at(lease).expired && still.count(lease) == 0) close(lease, {});
}

double Board::stretch(BoardLease id, double cost_ms, Millis now) const {
  const auto found = leases_.find(id);
  if (found == leases_.end() || cost_ms <= 0) return 1;
  const Lease& lease = found->second;
  const Millis since = std::max(lease.granted, workers_.at(lease.worker).finished);
  return std::max(1.0, static_cast<double>((now - since).count()) / cost_ms);
}

void Board::withdraw(const CellKey& key) {
  fresh_.erase(key);
  retries_.erase(key);
  if (const auto trouble = trouble_.find(key); trouble != trouble_.end()) {
    for (const WorkerId worker : trouble->second.blames) {
      conduct_[worker].belied(key);
      block_if_due(worker, conduct_[worker]);
    }
    trouble_.erase(trouble);
  }
  const auto leased = leased_.find(key);
  if (leased != leased_.end()) {
    const BoardLease first = leased->second;
    leased_.erase(leased);
    const std::optional<BoardLease> twin = leases_.at(first).twin;
    for (const std::optional<BoardLease> id : {std::optional(first), twin}) {
      const auto lease = id ? leases_.find(*id) : leases_.end();
      if (lease == leases_.end()) continue;
      std::erase(lease->second.cells, key);
      if (lease->second.cells.empty() && !lease->second.expired) supersede(*id, lease->second);
    }
  }
}

void Board::complete(const CellKey& key, double cost_ms, double stretch) {
  withdraw(key);
  cost_ms_ = cost_ms_ == 0 ? cost_ms : cost_ms_ + kMeanWeight * (cost_ms - cost_ms_);
  steps_.add(cost_ms * stretch);
  if (steps_.count() > kQuantilesEvery && steps_.count() % kQuantilesEvery != 0) return;
  median_ = steps_.quantile(0.5);
  p95_ = steps_.quantile(0.95);
}

// Nothing of it is left to do. Whoever completed it ends it at once; if another did, its worker has
// to be told.
void Board::supersede(BoardLease id, Lease& lease) {
  lease.expired = true;
  superseded_.push_back(id);
}

// Notes a failure. True: the cell is given up.
bool Board::troubled(const CellKey& key, WorkerId worker, bool alone, Failure failure, Millis now) {
  Trouble& trouble = trouble_[key];
  ++trouble.attempts;
  // In a task of several cells any of them may be to blame; alone it is the one.
  if (failure != Failure::kTransient && alone) trouble.failed_on.insert(worker);
  bool elsewhere = false;  // it need not wait
  if (failure == Failure::kDeterministic && alone) {
    elsewhere = trouble.blames.insert(worker).second;
    conduct_[worker].failed(key);
  }
  if (failure == Failure::kResource && alone) ++trouble.short_of_memory;
  if (trouble.attempts >= limits_.attempts || trouble.blames.size() >= limits_.failed_on ||
      trouble.short_of_memory >= limits_.short_of_memory) {
    for (const WorkerId id : trouble.blames) conduct_[id].forgive(key);
    for (auto& [id, machine] : machines_) machine.lost_at.erase(key);
    trouble_.erase(key);
    given_up_.push_back(key);
    return true;
  }
  if (failure == Failure::kDeterministic && alone) block_if_due(worker, conduct_[worker]);
  if (trouble.attempts > 1 && !elsewhere) {
    const int factor = failure == Failure::kResource ? 4 : 1;
    const int doubled = 1 << std::min(trouble.attempts - 2, kMaxDoublings);
    trouble.ready_at = now + factor * std::min(limits_.pause * doubled, limits_.longest_pause);
  }
  return false;
}

// The cells of a lease are with its copy alone, or pending again, or given up.
void Board::give_back(BoardLease id, Lease& lease, Failure failure, Millis now) {
  pass_to_twin(id, lease);
  const bool alone = lease.cells.size() == 1;
  for (const CellKey& key : lease.cells) {
    leased_.erase(key);
    if (failure != Failure::kReturned && troubled(key, lease.worker, alone, failure, now)) continue;
    if (trouble_.count(key) != 0)
      retries_.insert(key);
    else
      fresh_.insert(key);
  }
  lease.cells.clear();
}

void Board::pass_to_twin(BoardLease id, Lease& lease) {
  if (!lease.twin) return;
  const auto twin = leases_.find(*std::exchange(lease.twin, {}));
  if (twin == leases_.end()) return;
  twin->second.twin.reset();
  if (twin->second.expired) return;
  std::erase_if(lease.cells, [&](const CellKey& key) {
    const std::vector<CellKey>& others = twin->second.cells;
    if (std::find(others.begin(), others.end(), key) == others.end()) return false;
    if (leased_.at(key) == id) leased_[key] = twin->first;
    return true;
  });
}

void Board::close(BoardLease id, Millis now) {
  const auto found = leases_.find(id);
  if (found == leases_.end()) return;
  Worker& worker = workers_.at(found->second.worker);
  worker.leases.erase(id);
  worker.finished = std::max(worker.finished, now);
  leases_.erase(found);
}

void Board::finish(BoardLease id, Millis now) {
  std::erase(superseded_, id);
  fail(id, Failure::kTransient, now);
}

void Board::fail(BoardLease id, Failure failure, Millis now) {
  const auto found = leases_.find(id);
  if (found == leases_.end()) return;
  give_back(id, found->second, failure, now);
  close(id, now);
}

std::vector<BoardLease> Board::expire(Millis now) {
  std::vector<BoardLease> gone;
  if (now < next_look_) return gone;
  next_look_ = Millis::max();
  for (auto& [id, lease] : leases_) {
    if (lease.expired) continue;
    if (expiry(lease) > now) {
      next_look_ = std::min(next_look_, expiry(lease));
      continue;
    }
    give_back(id, lease, Failure::kTransient, now);
    lease.expired = true;
    gone.push_back(id);
  }
  return gone;
}

std::vector<BoardLease> Board::clear() {
  std::vector<BoardLease> ran;
  for (auto& [id, lease] : leases_) {
    if (!lease.expired) ran.push_back(id);
    lease.cells.clear();
    lease.expired = true;
  }
  fresh_.clear();
  retries_.clear();
  leased_.clear();
  return ran;
}

std::optional<WorkerId> Board::holder(BoardLease id) const {
  const auto found = leases_.find(id);
  if (found == leases_.end()) return std::nullopt;
  return found->second.worker;
}

std::size_t Board::lease_count(WorkerId id) const {
  const auto found = workers_.find(id);
  return found == workers_.end() ? 0 : found->second.leases.size();
}

std::optional<Millis> Board::next_expiry() const {
  std::optional<Millis> next;
  for (const auto& [id, lease] : leases_)
    if (!lease.expired && (!next || expiry(lease) < *next)) next = expiry(lease);
  return next;
}

}  // namespace pvsfarm
