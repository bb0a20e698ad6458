// Where a cell's time goes: the steps of provers and witnesses, told to who asks while they happen.
// Where nobody asks, nothing is told and nothing paid for it; where somebody does, no answer
// changes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pvsfarm {

// Tells processor time in milliseconds, for statistics; no decision depends on it.
using CpuClock = double (*)();

enum class Stage : std::uint8_t {
  kOther,      // sets, statistics, whatever has no stage of its own
  kOccluders,  // ranked, tried for legality, brought into the cell's frame; operations: looked at
  kPlanes,     // chosen; operations: planes
  kReset,      // of maps; operations: maps
  kWanted,     // tiles of maps that something falls on; operations: boxes against one plane
  kScreen,     // operations: occluders' boxes, each plane anew
  kProject,    // operations: pieces drawn
  kDraw,       // operations: rows of kTilePx pixels written
  kPyramids,   // operations: maps
  kTest,       // operations: boxes against one plane
  kAim,        // points drawn to look at; operations: rays
  kCast,       // Embree; operations: rays
  kCheck,      // of what Embree says, in double; operations: checks
  kEscape,     // lines past the edges of blockers, all in double; operations: rays
};
inline constexpr std::size_t kStageCount = 14;

struct StageWork {
  double cpu_ms = 0;
  std::uint64_t operations = 0;
  std::uint64_t bytes = 0;  // read or written one after the other; 0 where access is scattered
};

struct Stages {
  CpuClock clock = nullptr;
  std::array<StageWork, kStageCount> work{};
  Stage now = Stage::kOther;
  double since_ms = 0;
};

// Brackets a stage, to which time goes until the end or until another within begins.
// `stages` may be null, its clock may not.
class StageScope {
 public:
  StageScope(Stages* stages, Stage stage) : stages_(stages) {
    if (stages_ == nullptr) return;
    outer_ = stages_->now;
    turn_to(stage);
  }
  ~StageScope() {
    if (stages_ != nullptr) turn_to(outer_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;
  void did(std::uint64_t operations, std::uint64_t bytes = 0) {
    if (stages_ == nullptr) return;
    StageWork& work = stages_->work[static_cast<std::size_t>(stages_->now)];
    work.operations += operations;
    work.bytes += bytes;
  }

 private:
  void turn_to(Stage stage) {
    const double now_ms = stages_->clock();
    stages_->work[static_cast<std::size_t>(stages_->now)].cpu_ms += now_ms - stages_->since_ms;
    stages_->now = stage;
    stages_->since_ms = now_ms;
  }

  Stages* stages_;
  Stage outer_ = Stage::kOther;
};

}  // namespace pvsfarm
