// Row 1 of the fault table: the same bytes, however many workers come, leave and pause.
#include "common/base/random.hpp"
#include "tests/farm/farm_fixture.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

using SchedulesTest = FarmFixture;

void sleep_ms(double ms) {
  std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(ms));
}

// Joins, leaves (SIGTERM) and pauses (SIGSTOP) of up to `most` workers, until the bake is over.
void play(Random& random, Crew& crew, std::size_t most, const std::string& endpoint,
          Process& coordinator) {
  std::vector<std::size_t> present;
  while (coordinator.running()) {
    const std::uint64_t what = random.below(8);
    if (present.empty() || (present.size() < most && what < 4)) {
      present.push_back(crew.start(endpoint));
    } else if (what == 4) {
      const std::size_t at = random.below(present.size());
      crew.send(present[at], SIGTERM);
      present.erase(present.begin() + static_cast<std::ptrdiff_t>(at));
    } else if (what == 5) {
      const std::size_t worker = present[random.below(present.size())];
      crew.send(worker, SIGSTOP);
      sleep_ms(random.between(20, 400));
      crew.send(worker, SIGCONT);
    }
    sleep_ms(random.between(20, 300));
  }
}

}  // namespace

TEST_F(SchedulesTest, any_schedule_of_joins_leaves_and_pauses_makes_the_same_bytes) {
  const int schedules = full_counts() ? 10 : 2;
  int runs = 0, identical = 0;
  for (const std::size_t workers : {1, 2, 4}) {
    for (int schedule = 0; schedule < schedules; ++schedule, ++runs) {
      const std::uint64_t seed = 100 * workers + static_cast<std::uint64_t>(schedule);
      SCOPED_TRACE("seed " + std::to_string(seed));
      Random random(seed);
      const auto coordinator = coordinate();
      Crew workers_now = crew("worker");
      play(random, workers_now, workers, endpoint(), *coordinator);
      const Outcome result = outcome(*coordinator);
      EXPECT_TRUE(result.well()) << coordinator->err();
      identical += result.well() ? 1 : 0;
      for (std::size_t i = 0; i < workers_now.size(); ++i) {
        workers_now.send(i, SIGTERM);  // one that came too late would wait for another bake
        const int code = workers_now.process(i).wait(10);
        // By the signal itself: it had not begun yet.
        EXPECT_TRUE(code == 0 || code == 128 + SIGTERM) << workers_now.process(i).err();
      }
    }
  }
  record({.row = 1,
          .what = "stores identical to that of one undisturbed worker",
          .asked = std::to_string(runs) + " of " + std::to_string(runs),
          .reached = std::to_string(identical) + " of " + std::to_string(runs),
          .held = identical == runs});
}

}  // namespace pvsfarm
