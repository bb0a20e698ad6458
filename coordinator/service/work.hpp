// What a farm works on. The desk knows workers, leases and messages; the work knows what a task
// holds and what becomes of its result. A bake is one kind of work, an inquiry another.
// Threads: one.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/base/result.hpp"
#include "common/wire/messages.hpp"
#include "coordinator/board/board.hpp"
#include "coordinator/board/estimate.hpp"
#include "coordinator/service/set_shelf.hpp"

namespace pvsfarm {

inline LeaseId wire_id(BoardLease id) { return LeaseId{static_cast<std::uint64_t>(id)}; }
inline BoardLease board_id(LeaseId id) { return BoardLease{static_cast<std::uint64_t>(id)}; }

// All of a result: its chunks put together, their digest checked.
struct WorkResult {
  std::string worker;  // its name, for warnings
  WorkerId id{};
  LeaseId lease{};
  std::variant<ResultBegin, FindingBegin> head;
  Bytes data;
};

struct WorkAnswer {
  struct Done {
    CellKey key;
    double cost_ms = 0;
    bool split = false;  // its two halves are open now
  };
  struct Again {
    CellKey key;
    std::vector<WorkerId> avoid;  // if there are others
  };
  struct Wrong {
    WorkerId worker{};
    CellKey key;
  };
  ResultOutcome outcome = ResultOutcome::kDuplicate;
  std::vector<Done> done;        // for the first time
  std::vector<Again> again;      // to be done once more
  std::vector<CellKey> checked;  // of those: not any longer
  std::vector<Wrong> wrong;      // whose results two others contradict
  std::vector<std::string> warnings;
};

struct WorkProgress {
  ProgressFigures figures;
  std::uint64_t result_bytes = 0;
  std::uint64_t journal_bytes = 0;
  std::vector<CellKey> given_up;  // the first few
  std::uint64_t given_up_count = 0;
};

class Work {
 public:
  virtual ~Work() = default;

  // Keys to be put on the board: asked for at the start, and again whenever something was done.
  // `pending` are there already. Done is the work when the board is empty and nothing more comes.
  virtual std::vector<CellKey> take_open(std::size_t pending) = 0;
  // Whether both may be in one task. [limit] a task holds kMaxTaskCells
  virtual bool together(const CellKey& /*first*/, const CellKey& /*next*/) const { return true; }
  // The message that gives a task to a worker. The sets it leaves on `shelf` are kept while the
  // task is out. Errors: fatal.
  virtual Result<Message> task(const BoardTask& task, SetShelf& shelf) = 0;
  // Takes a result, whatever became of its lease. Errors: kInvalidInput, the worker is at fault,
  // and `answer` says what was taken before; others are fatal.
  virtual Status accept(const WorkResult& result, WorkAnswer& answer) = 0;
  // Too many workers failed at it. Says so in one line.
  virtual std::string give_up(const CellKey& key) = 0;

  // Whether a worker that computes cells since before this coordinator began may go on with them.
  virtual bool adopts() const { return false; }

  // Results are acknowledged once they are durable.
  virtual std::size_t uncommitted() const { return 0; }
  virtual Status commit() { return {}; }
  // The last commit() found no room for them: until one succeeds, nothing more is to be begun or
  // accepted, and workers are given no credit.
  virtual bool disk_full() const { return false; }
  // The kernel of the first worker, before any of its results is taken.
  virtual Status keep_kernel(const std::string& /*kernel*/) { return {}; }

  virtual WorkProgress progress(Millis now) = 0;
  virtual std::string name_of(const CellKey& key) const = 0;  // "cell 3/1"
  virtual std::string when_stopped() const = 0;               // what is kept, for whoever stops it
};

}  // namespace pvsfarm
