#include "coordinator/board/board.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {
constexpr double kMeanWeight = 0.05;  // of the newest cell in the moving mean
constexpr double kSlowestFactor = 8;  // a lease lasts at least so many of the slowest cell yet
constexpr unsigned kMaxDoublings = 6;
}  // namespace

void Board::add(const CellKey& key) { pending_.insert(key); }

void Board::join(WorkerId id, unsigned slots) {
  PVS_CHECK(workers_.count(id) == 0);
  workers_[id].slots = slots;
  slots_ += slots;
}

void Board::stop_leasing(WorkerId id) {
  const auto found = workers_.find(id);
  if (found != workers_.end()) found->second.draining = true;
}

void Board::leave(WorkerId id, Parting parting) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  const std::set<BoardLease> held = found->second.leases;
  for (const BoardLease lease : held)
    fail(lease, parting == Parting::kLost ? Failure::kTransient : Failure::kReturned);
  slots_ -= found->second.slots;
  workers_.erase(found);
}

std::size_t Board::batch_size() const {
  if (cost_ms_ <= 0) return 1;
  const double wanted = std::ceil(limits_.task_ms / cost_ms_);
  // Towards the end every worker shall have something to do.
  const std::size_t share = pending_.size() / (2 * std::max<std::size_t>(slots_, 1)) + 1;
  return std::min({static_cast<std::size_t>(std::min(wanted, 1e6)), share, limits_.task_cells});
}

std::optional<BoardTask> Board::lease(WorkerId id, Millis now, const Together& together) {
  const auto worker = workers_.find(id);
  if (worker == workers_.end() || worker->second.draining || pending_.empty() ||
      worker->second.leases.size() >= worker->second.slots * limits_.leases_per_slot)
    return std::nullopt;

  BoardTask task{.lease = BoardLease{next_lease_++}};
  const std::size_t size = batch_size();
  while (!pending_.empty() && task.cells.size() < size) {
    const CellKey key = *pending_.begin();
    if (!task.cells.empty() && together && !together(task.cells.front(), key)) break;
    const auto trouble = trouble_.find(key);
    if (trouble != trouble_.end()) {
      if (!task.cells.empty()) break;
      task.attempt = trouble->second.attempts;
    }
    pending_.erase(pending_.begin());
    task.cells.push_back(key);
    leased_[key] = task.lease;
    if (trouble != trouble_.end()) break;
  }

  const auto slowest = Millis(static_cast<std::int64_t>(kSlowestFactor * slowest_ms_));
  const Millis duration =
      std::max(limits_.lease, slowest) * (1 << std::min(task.attempt, kMaxDoublings));
  leases_[task.lease] = {
      .worker = id, .cells = task.cells, .duration = duration, .expires = now + duration};
  worker->second.leases.insert(task.lease);
  return task;
}

bool Board::renew(BoardLease id, std::uint64_t progress, Millis now) {
  const auto found = leases_.find(id);
  if (found == leases_.end() || found->second.expired) return false;
  Lease& lease = found->second;
  Worker& worker = workers_.at(lease.worker);
  if (progress > lease.progress) {
    lease.progress = progress;
    worker.advanced = now;
    lease.expires = now + lease.duration;
  } else if (progress == 0) {
    lease.expires = std::max(lease.expires, worker.advanced + lease.duration);
  }
  return true;
}

void Board::release_expired(WorkerId id, const std::set<BoardLease>& still) {
  const auto worker = workers_.find(id);
  if (worker == workers_.end()) return;
  const std::set<BoardLease> held = worker->second.leases;
  for (const BoardLease lease : held)
    if (leases_.at(lease).expired && still.count(lease) == 0) close(lease);
}

void Board::complete(const CellKey& key, double cost_ms) {
  pending_.erase(key);
  trouble_.erase(key);
  const auto leased = leased_.find(key);
  if (leased != leased_.end()) {
    std::vector<CellKey>& cells = leases_.at(leased->second).cells;
    cells.erase(std::find(cells.begin(), cells.end(), key));
    leased_.erase(leased);
  }
  cost_ms_ = cost_ms_ == 0 ? cost_ms : cost_ms_ + kMeanWeight * (cost_ms - cost_ms_);
  slowest_ms_ = std::max(slowest_ms_, cost_ms);
}

// The cells of a lease are pending again, or given up.
void Board::give_back(Lease& lease, Failure failure) {
  for (const CellKey& key : lease.cells) {
    leased_.erase(key);
    if (failure != Failure::kReturned) {
      Trouble& trouble = trouble_[key];
      ++trouble.attempts;
      // In a task of several cells any of them may be to blame; alone it is the one.
      if (failure == Failure::kDeterministic && lease.cells.size() == 1) ++trouble.deterministic;
      if (trouble.attempts >= limits_.attempts ||
          trouble.deterministic >= limits_.deterministic_failures) {
        trouble_.erase(key);
        given_up_.push_back(key);
        continue;
      }
    }
    pending_.insert(key);
  }
  lease.cells.clear();
}

void Board::close(BoardLease id) {
  const auto found = leases_.find(id);
  if (found == leases_.end()) return;
  workers_.at(found->second.worker).leases.erase(id);
  leases_.erase(found);
}

void Board::finish(BoardLease id) { fail(id, Failure::kTransient); }

void Board::fail(BoardLease id, Failure failure) {
  const auto found = leases_.find(id);
  if (found == leases_.end()) return;
  give_back(found->second, failure);
  close(id);
}

std::vector<BoardLease> Board::expire(Millis now) {
  std::vector<BoardLease> gone;
  for (auto& [id, lease] : leases_) {
    if (lease.expired || lease.expires > now) continue;
    give_back(lease, Failure::kTransient);
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
  pending_.clear();
  leased_.clear();
  return ran;
}

std::vector<CellKey> Board::take_given_up() { return std::exchange(given_up_, {}); }

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
    if (!lease.expired && (!next || lease.expires < *next)) next = lease.expires;
  return next;
}

}  // namespace pvsfarm
