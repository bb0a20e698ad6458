// The coordinator under load: the real desk, and for cells the real tree, merger and journal, with
// peers that only know how to answer. What is measured is processor time of the coordinator's own
// calls (with decoding and encoding, without sockets) and the memory of the process, peers and all.
#include <gtest/gtest.h>
#include <time.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "coordinator/journal/journal.hpp"
#include "coordinator/service/bake_work.hpp"
#include "coordinator/service/desk.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

using namespace std::chrono_literals;

double cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) / 1e9;
}

double resident_mib() {
  unsigned long pages = 0, resident = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lu %lu", &pages, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::span<const std::byte> view(const std::string& text) { return std::as_bytes(std::span(text)); }

Hello hello_of(std::size_t i) {
  Hello hello;
  hello.pid = static_cast<std::uint32_t>(i + 1);
  hello.worker[0] = static_cast<std::uint8_t>(i);
  hello.worker[1] = static_cast<std::uint8_t>(i >> 8);
  return hello;
}

struct Peer {
  std::string name;
  std::uint64_t session = 0;
  std::vector<Frames> to_send;
};

// Peers that send what the coordinator makes them send, and nothing on their own.
class Crowd {
 public:
  Crowd(Desk& desk, std::size_t count) : desk_(desk) {
    for (std::size_t i = 0; i < count; ++i) {
      peers_[std::to_string(i)].name = std::to_string(i);
      say(peers_[std::to_string(i)], hello_of(i));
    }
  }
  virtual ~Crowd() = default;

  // All that is to be said and heard until nobody has anything more to say.
  void turn(Millis now) {
    bool any = true;
    while (any) {
      any = false;
      for (auto& [name, peer] : peers_) {
        const std::vector<Frames> frames = std::exchange(peer.to_send, {});
        any = any || !frames.empty();
        const double before_s = cpu_s();
        for (const Frames& frame : frames)
          EXPECT_TRUE(desk_.receive(name, decode(view(frame.header), view(frame.body)), now).ok());
        if (!frames.empty()) hear(now);
        coordinator_s += cpu_s() - before_s - peers_s_;
        peers_s_ = 0;
      }
      const double before_s = cpu_s();
      hear(now);
      coordinator_s += cpu_s() - before_s - peers_s_;
      peers_s_ = 0;
    }
  }
  void say(Peer& peer, const Message& message) {
    peer.to_send.push_back(encode({.session = peer.session, .epoch = 1}, message));
  }
  std::map<std::string, Peer> peers_;
  double coordinator_s = 0;

 protected:
  virtual void answer(Peer& peer, const Message& message) = 0;

 private:
  void hear(Millis now) {
    EXPECT_TRUE(desk_.tick(now).ok());
    for (const Outgoing& out : desk_.take_outgoing()) {
      const Frames frames = encode(out.envelope, out.message);
      const double before_s = cpu_s();
      Peer& peer = peers_.at(out.peer);
      if (std::holds_alternative<Welcome>(out.message)) {
        peer.session = out.envelope.session;
        say(peer, Heartbeat{.running = {}, .ready = true});
      } else {
        answer(peer, out.message);
      }
      peers_s_ += cpu_s() - before_s;
    }
  }
  Desk& desk_;
  double peers_s_ = 0;
};

// Evaluates cells of a world in which every cell hides the same.
class TinyCells : public Crowd {
 public:
  TinyCells(Desk& desk, std::size_t count, Bytes hidden, Bytes seen)
      : Crowd(desk, count), hidden_(std::move(hidden)), seen_(std::move(seen)) {}

 private:
  void answer(Peer& peer, const Message& message) override {
    const auto* task = std::get_if<Task>(&message);
    if (task == nullptr) return;
    ResultBegin begin{.lease = task->lease, .deltas = {}};
    Bytes data;
    for (const TaskCell& cell : task->cells) {
      begin.deltas.push_back(
          {cell.key, hidden_.size(), seen_.size(), 5, {.cpu_ms = 0.5, .planes = 6}});
      for (const Bytes* set : {&hidden_, &seen_}) data.insert(data.end(), set->begin(), set->end());
    }
    begin.bytes = data.size();
    say(peer, begin);
    for (std::size_t offset = 0; offset < data.size(); offset += kChunkBytes) {
      const std::size_t size = std::min(kChunkBytes, data.size() - offset);
      const auto first = data.begin() + static_cast<std::ptrdiff_t>(offset);
      say(peer, ResultChunk{task->lease, offset,
                            Bytes(first, first + static_cast<std::ptrdiff_t>(size))});
    }
    say(peer, ResultEnd{task->lease, digest_of(data)});
  }
  Bytes hidden_, seen_;
};

// Takes tasks and never answers.
struct Mute : Crowd {
  using Crowd::Crowd;
  void answer(Peer&, const Message&) override {}
};

// Takes results as large as they come, until it pauses in the middle of them.
struct PausedWork : Work {
  bool paused = false;
  std::uint64_t pause_at = 0, accepted_bytes = 0;

  std::vector<CellKey> take_open(std::size_t) override { return {}; }
  Result<Message> task(const BoardTask&, SetShelf&) override { return invalid_input("no tasks"); }
  Status accept(const WorkResult& result, WorkAnswer& answer) override {
    EXPECT_FALSE(paused);
    accepted_bytes += result.data.size();
    paused = accepted_bytes == pause_at;
    answer.outcome = ResultOutcome::kMerged;
    return {};
  }
  bool disk_full() const override { return paused; }
  std::string give_up(const CellKey&) override { return ""; }
  WorkProgress progress(Millis) override { return {}; }
  std::string name_of(const CellKey&) const override { return ""; }
  std::string when_stopped() const override { return ""; }
};

// Each peer has results of 3 MiB that it wants to get rid of, and obeys credit.
class LargeResults : public Crowd {
 public:
  LargeResults(Desk& desk, std::size_t count, int results) : Crowd(desk, count) {
    for (auto& [name, peer] : peers_) left_[name] = results;
  }
  void offer(Peer& peer) {
    if (left_[peer.name] == 0) return;
    const LeaseId lease{1'000'000 + static_cast<std::uint64_t>(left_[peer.name])};
    ResultBegin begin{.lease = lease, .bytes = data_.size(), .deltas = {}};
    begin.deltas.push_back({CellKey{1, 1}, data_.size(), 0, 0, {}});
    sent_[peer.name] = 0;
    say(peer, begin);
  }
  bool all_gone() const {
    for (const auto& [name, left] : left_)
      if (left > 0) return false;
    return true;
  }

 private:
  void answer(Peer& peer, const Message& message) override {
    if (std::holds_alternative<ResultAck>(message)) {
      EXPECT_EQ(std::get<ResultAck>(message).outcome, ResultOutcome::kMerged);
      --left_[peer.name];
      return offer(peer);
    }
    const auto* credit = std::get_if<ChunkCredit>(&message);
    if (credit == nullptr) return;
    std::uint64_t& sent = sent_[peer.name];
    for (; sent < credit->chunks && sent * kChunkBytes < data_.size(); ++sent) {
      const auto first = data_.begin() + static_cast<std::ptrdiff_t>(sent * kChunkBytes);
      say(peer, ResultChunk{credit->lease, sent * kChunkBytes,
                            Bytes(first, first + static_cast<std::ptrdiff_t>(kChunkBytes))});
    }
    if (sent * kChunkBytes >= data_.size()) say(peer, ResultEnd{credit->lease, digest_});
  }
  Bytes data_ = Bytes(12 * kChunkBytes, std::byte{3});
  Digest digest_ = digest_of(data_);
  std::map<std::string, int> left_;
  std::map<std::string, std::uint64_t> sent_;
};

struct TemporaryFolder {
  std::string path;
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "pvsfarm_load_XXXXXX").string();
    path = mkdtemp(pattern.data());
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path); }
};

}  // namespace

TEST(DeskLoad, merging_pauses_for_a_minute_under_two_hundred_workers) {
  PausedWork work;
  Desk desk({.scene_digest = digest_of(Bytes{}), .epoch = 1}, work, 0ms);
  LargeResults crowd(desk, 200, 3);
  double most_mib = 0;
  Millis now{0};
  crowd.turn(now);
  // Many results are in the middle of their way when the pause begins.
  work.pause_at = 20ull * 12 * kChunkBytes;
  for (auto& [name, peer] : crowd.peers_) crowd.offer(peer);
  for (; now < 60s; now += 500ms) {
    crowd.turn(now);
    if (now.count() % 2'000 == 0)
      for (auto& [name, peer] : crowd.peers_)
        crowd.say(peer, Heartbeat{.running = {}, .ready = true});
    most_mib = std::max(most_mib, resident_mib());
  }
  EXPECT_GT(most_mib, 200);  // they are held
  EXPECT_EQ(work.accepted_bytes, work.pause_at);
  work.paused = false;
  for (; !crowd.all_gone() && now < 120s; now += 20ms) {
    crowd.turn(now);
    most_mib = std::max(most_mib, resident_mib());
  }
  EXPECT_EQ(work.accepted_bytes, 200ull * 3 * 12 * kChunkBytes);
  EXPECT_LE(most_mib, 512);
  record({.row = 17,
          .what = "MiB resident, with the peers, results of 3 MiB",
          .asked = "512",
          .reached = number(most_mib),
          .held = most_mib <= 512});
}

// A worker that has nothing to do is looked after every 50 ms, while another may be late; but not
// if it would get nothing anyway: then the loop may sleep until the next heartbeat is due.
TEST(DeskLoad, a_pause_lets_the_coordinator_sleep_though_a_worker_is_idle) {
  const TemporaryFolder folder;
  auto journal = Journal::open(folder.path + "/x.journal", {digest_of(Bytes{}), ""});
  ASSERT_TRUE(journal.ok()) << journal.error().text;
  Tree tree({VisibleSet::all(8), std::vector<std::uint32_t>(8, 10)},
            {Cell::aligned({{0, 0, 0}, {1, 1, 1}})}, {});
  BakeWork work(tree, **journal, Estimate());
  Desk desk({.scene_digest = digest_of(Bytes{}), .epoch = 1}, work, 0ms);
  Mute crowd(desk, 2);
  crowd.turn(0ms);
  crowd.turn(100ms);
  EXPECT_LE(desk.next_wake(120ms), 150ms);  // one has the only cell, the other waits for it
  crowd.say(crowd.peers_.at("0"), Control{ControlKind::kPause});
  crowd.turn(200ms);
  EXPECT_GE(desk.next_wake(400ms), 900ms);
  crowd.say(crowd.peers_.at("0"), Control{ControlKind::kResume});
  crowd.turn(500ms);
  EXPECT_LE(desk.next_wake(520ms), 550ms);
}

TEST(DeskLoad, tiny_cells_are_merged_fast_and_leave_nothing_behind) {
  const std::uint32_t cells = full_counts() ? 1'000'000 : 60'000;
  constexpr std::uint32_t kObjects = 64;
  const TemporaryFolder folder;
  auto journal = Journal::open(folder.path + "/x.journal", {digest_of(Bytes{}), ""});
  ASSERT_TRUE(journal.ok()) << journal.error().text;
  std::vector<Cell> roots(cells, Cell::aligned({{0, 0, 0}, {1, 1, 1}}));
  Tree tree({VisibleSet::all(kObjects), std::vector<std::uint32_t>(kObjects, 10)}, std::move(roots),
            {});
  BakeWork work(tree, **journal, Estimate());
  Desk desk({.scene_digest = digest_of(Bytes{}), .epoch = 1}, work, 0ms);
  VisibleSet hidden = VisibleSet::all(kObjects), seen = VisibleSet::all(kObjects);
  for (std::uint32_t i = 0; i < kObjects; ++i) (i % 2 == 0 ? hidden : seen).remove(ObjectId{i});
  TinyCells crowd(desk, 1'000, encode(hidden), encode(seen));

  double quarter_mib = 0;
  Millis now{0};
  for (; !desk.done() && now < 1h; now += 20ms) {
    crowd.turn(now);
    if (quarter_mib == 0 && (*journal)->row_count() >= cells / 4) quarter_mib = resident_mib();
  }
  ASSERT_TRUE(desk.done());
  EXPECT_EQ((*journal)->row_count(), cells);
  const double growth = 100 * (resident_mib() / quarter_mib - 1);
  const double merges = cells / crowd.coordinator_s;
  EXPECT_LE(growth, 5);
  EXPECT_GE(merges, 5'000);
  record({.row = 18,
          .what = "growth of memory from 25 % to 100 % of " + std::to_string(cells) + " cells",
          .asked = "5 %",
          .reached = number(growth) + " %",
          .held = growth <= 5});
  record({.row = 18,
          .what = "cells merged and journalled a second of the coordinator's processor time",
          .asked = "5,000",
          .reached = number(merges),
          .held = merges >= 5'000});
}

}  // namespace pvsfarm
