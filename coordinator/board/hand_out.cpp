// Which cells go to a worker that asks.
#include <algorithm>
#include <cmath>
#include <utility>

#include "coordinator/board/board.hpp"

namespace pvsfarm {

std::size_t Board::batch_size() const {
  if (cost_ms_ <= 0) return 1;
  const double wanted = std::ceil(limits_.task_ms / cost_ms_);
  // Towards the end tasks become smaller, so that all workers end together.
  const std::size_t share = fresh_.size() / (2 * std::max<std::size_t>(slots_, 1)) + 1;
  return std::min({static_cast<std::size_t>(std::min(wanted, 1e6)), share, limits_.task_cells});
}

BoardTask Board::grant(WorkerId id, Worker& worker, std::vector<CellKey> cells, Millis now) {
  BoardTask task{.lease = BoardLease{next_lease_++}, .cells = std::move(cells)};
  const auto trouble = trouble_.find(task.cells.front());
  if (trouble != trouble_.end()) task.attempt = trouble->second.attempts;
  Lease& lease = leases_[task.lease];
  lease = {.worker = id,
           .cells = task.cells,
           .size = task.cells.size(),
           .attempt = task.attempt,
           .granted = now,
           .heard = now,
           .advanced = now};
  worker.leases.insert(task.lease);
  next_look_ = std::min(next_look_, expiry(lease));
  return task;
}

std::optional<BoardTask> Board::lease(WorkerId id, Millis now, const Together& together) {
  const auto found = workers_.find(id);
  if (found == workers_.end() || found->second.draining) return std::nullopt;
  Worker& worker = found->second;
  if (worker.leases.size() >= worker.slots * limits_.leases_per_slot) return std::nullopt;
  for (const BoardLease lease : worker.leases)
    if (leases_.at(lease).attempt > 0) return std::nullopt;  // on trial, alone

  if (const std::optional<CellKey> retry = retry_for(id, now)) {
    if (!worker.leases.empty()) return std::nullopt;  // soon
    retries_.erase(*retry);
    const BoardTask task = grant(id, worker, {*retry}, now);
    leased_[*retry] = task.lease;
    return task;
  }
  if (fresh_.empty()) return worker.leases.empty() ? spare_for(id, worker, now) : std::nullopt;

  std::vector<CellKey> cells;
  const std::size_t size = batch_size();
  while (!fresh_.empty() && cells.size() < size) {
    const CellKey key = *fresh_.begin();
    if (!cells.empty() && together && !together(cells.front(), key)) break;
    fresh_.erase(fresh_.begin());
    cells.push_back(key);
  }
  const BoardTask task = grant(id, worker, std::move(cells), now);
  for (const CellKey& key : task.cells) leased_[key] = task.lease;
  return task;
}

// A cell that failed before and whose pause is over; not where it failed for a reason, as long as
// there is another worker for it.
std::optional<CellKey> Board::retry_for(WorkerId id, Millis now) const {
  for (const CellKey& key : retries_) {
    const auto found = trouble_.find(key);
    if (found == trouble_.end()) return key;
    const Trouble& trouble = found->second;
    if (trouble.ready_at > now) continue;
    if (trouble.failed_on.count(id) == 0) return key;
    const bool others = std::any_of(workers_.begin(), workers_.end(), [&](const auto& other) {
      return !other.second.draining && trouble.failed_on.count(other.first) == 0;
    });
    if (!others) return key;
  }
  return std::nullopt;
}

// Since when a lease is computed, as far as one can know: a worker takes them in their order.
// None: it waits behind others.
std::optional<Millis> Board::running_since(BoardLease id, const Lease& lease) const {
  if (lease.began) return lease.began;
  const Worker& worker = workers_.at(lease.worker);
  const auto place = std::distance(worker.leases.begin(), worker.leases.find(id));
  if (place >= static_cast<std::ptrdiff_t>(worker.slots)) return std::nullopt;
  return std::max(lease.granted, worker.finished);
}

bool Board::straggles(const Lease& lease, Millis since, Millis now) const {
  const auto cells = static_cast<std::int64_t>(lease.size);
  return now - since > std::max({limits_.speculate_after, 2 * median_ * cells, p95_ * cells});
}

// The lease that is late by the most: moved if its worker has not begun it, else copied.
std::optional<BoardTask> Board::spare_for(WorkerId id, Worker& worker, Millis now) {
  if (median_.count() == 0) return std::nullopt;
  auto best = leases_.end();
  bool runs = false;
  Millis earliest = Millis::max();
  for (auto at = leases_.begin(); at != leases_.end(); ++at) {
    const Lease& lease = at->second;
    if (lease.expired || lease.copied || lease.worker == id || lease.cells.empty()) continue;
    const std::optional<Millis> began = running_since(at->first, lease);
    const Millis since = began.value_or(lease.granted);
    if (since >= earliest || !straggles(lease, since, now)) continue;
    best = at;
    runs = began.has_value();
    earliest = since;
  }
  if (best == leases_.end()) return std::nullopt;

  Lease& late = best->second;
  const BoardTask task = grant(id, worker, late.cells, now);
  if (runs) {
    Lease& copy = leases_.at(task.lease);
    late.copied = copy.copied = true;
    late.twin = task.lease;
    copy.twin = best->first;
    ++copies_;
    return task;
  }
  for (const CellKey& key : task.cells) leased_[key] = task.lease;
  late.cells.clear();
  supersede(best->first, late);
  return task;
}

}  // namespace pvsfarm
