#include "tests/fuzz/driver.hpp"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>

#include "common/base/random.hpp"
#include "tests/support/fault_figures.hpp"

#if defined(__SANITIZE_ADDRESS__)
extern "C" void __sanitizer_set_death_callback(void (*callback)());
constexpr bool kSanitized = true;
// Undefined behaviour ends the process as well, where it would only be printed.
extern "C" const char* __ubsan_default_options() { return "halt_on_error=1:print_stacktrace=1"; }
// Importers of assimp forget memory where they refuse a file; of ours, none may be forgotten.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp.so"; }
#else
constexpr bool kSanitized = false;
#endif

namespace pvsfarm::fuzz {
namespace {

constexpr unsigned kHangSeconds = 20;
constexpr std::size_t kMaxCorpus = 4096;

std::span<const std::uint8_t> current;

void keep_current() {
  std::uint32_t name = 2166136261u;
  for (const std::uint8_t byte : current) name = (name ^ byte) * 16777619u;
  char path[64];
  std::snprintf(path, sizeof path, "crash-%s-%08x", kTarget, name);
  const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  [[maybe_unused]] ssize_t written = write(file, current.data(), current.size());
  written = write(2, path, std::strlen(path));
  written = write(2, "\n", 1);
}

void on_end(int signal) {
  keep_current();
  _exit(128 + signal);
}

void watch_for_the_end() {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_set_death_callback(keep_current);
  signal(SIGABRT, on_end);
  signal(SIGALRM, on_end);
#else
  for (const int number : {SIGABRT, SIGALRM, SIGSEGV, SIGBUS, SIGFPE, SIGILL})
    signal(number, on_end);
#endif
}

void run_one(const Input& input) {
  // Allocated to the byte, so that a sanitizer sees one too far.
  const Input exact(input.begin(), input.end());
  current = exact;
  alarm(kHangSeconds);
  run(exact);
  alarm(0);
  current = {};
}

constexpr std::array<std::uint64_t, 12> kNumbers{
    0, 1, 0x7f, 0x80, 0xff, 0xffff, 0x10000, 0x7fffffff, 0x80000000, 0xffffffff, 1ull << 63, ~0ull};

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(random_.next() % std::max<std::size_t>(count, 1));
  }
  Input mutate(Input input, const Input& other) {
    for (std::size_t steps = std::size_t{1} << below(5); steps > 0; --steps) step(input, other);
    if (input.size() > kMaxInput) input.resize(kMaxInput);
    return input;
  }

 private:
  using Offset = std::ptrdiff_t;

  void step(Input& input, const Input& other) {
    const std::size_t at = below(input.size());
    switch (input.empty() ? 5 : below(9)) {
      case 0:
        input[at] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 1:
        input[at] = static_cast<std::uint8_t>(random_.next());
        break;
      case 2:
        write_number(input, at, kNumbers[below(kNumbers.size())]);
        break;
      case 3:
        add_to_number(input, at);
        break;
      case 4:
        input.erase(input.begin() + Offset(at), input.begin() + Offset(end(input, at)));
        break;
      case 5:
        input.insert(input.begin() + Offset(at), 1 + below(8), random_.next() & 0xff);
        break;
      case 6:
        repeat(input, at);
        break;
      case 7:
        splice(input, at, other);
        break;
      default:
        input.resize(at);
        break;
    }
  }
  std::size_t end(const Input& input, std::size_t at) {
    const std::size_t most = std::min<std::size_t>(input.size() - at, below(4) == 0 ? 4096 : 16);
    return at + 1 + below(most);
  }
  void write_number(Input& input, std::size_t at, std::uint64_t number) {
    const std::size_t bytes = std::min(std::size_t{1} << below(4), input.size() - at);
    std::memcpy(&input[at], &number, bytes);
  }
  void add_to_number(Input& input, std::size_t at) {
    const std::size_t bytes = std::min(std::size_t{1} << below(4), input.size() - at);
    std::uint64_t number = 0;
    std::memcpy(&number, &input[at], bytes);
    number += below(70) - 35;
    std::memcpy(&input[at], &number, bytes);
  }
  void repeat(Input& input, std::size_t at) {
    const Input part(input.begin() + Offset(at), input.begin() + Offset(end(input, at)));
    for (std::size_t times = 1 + below(4); times > 0 && input.size() < kMaxInput; --times)
      input.insert(input.begin() + Offset(at), part.begin(), part.end());
  }
  void splice(Input& input, std::size_t at, const Input& other) {
    if (other.empty()) return;
    const std::size_t from = below(other.size());
    const std::size_t to = end(other, from);
    if (below(2) == 0) {
      input.insert(input.begin() + Offset(at), other.begin() + Offset(from),
                   other.begin() + Offset(to));
    } else {
      std::copy_n(other.begin() + Offset(from), std::min(to - from, input.size() - at),
                  input.begin() + Offset(at));
    }
  }

  Random random_;
};

struct Options {
  double seconds = 120;
  std::uint64_t runs = ~0ull, seed = 1;
  std::vector<std::string> files;
};

Options options_of(int argc, char** argv) {
  Options options;
  if (full_counts()) options.seconds = 600;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const char* value = i + 1 < argc ? argv[i + 1] : "0";
    if (word == "--seconds") {
      options.seconds = std::atof(value), ++i;
    } else if (word == "--runs") {
      options.runs = std::strtoull(value, nullptr, 10), ++i;
    } else if (word == "--seed") {
      options.seed = std::strtoull(value, nullptr, 10), ++i;
    } else {
      options.files.push_back(word);
    }
  }
  if (full_counts()) options.runs = ~0ull;
  return options;
}

int run_files(const std::vector<std::string>& files) {
  for (const std::string& path : files) {
    std::ifstream file(path, std::ios::binary);
    run_one({std::istreambuf_iterator<char>(file), {}});
    std::printf("%s: no finding\n", path.c_str());
  }
  return 0;
}

int fuzz(const Options& options) {
  using Clock = std::chrono::steady_clock;
  std::vector<Input> corpus = seeds();
  for (const Input& input : corpus) {
    reset_coverage();
    run_one(input);
    reached_something_new();
  }
  const std::size_t seed_count = corpus.size(), reached_by_seeds = reached_count();
  Mutator mutator(options.seed);
  std::uint64_t runs = 0;
  const auto end = Clock::now() + std::chrono::duration<double>(options.seconds);
  for (; runs < options.runs && (runs % 16 != 0 || Clock::now() < end); ++runs) {
    // The newest inputs more often: what has just been reached leads on.
    const std::size_t n = corpus.size();
    const std::size_t pick =
        mutator.below(2) == 0 ? mutator.below(n) : n - 1 - mutator.below(n / 4);
    Input input = mutator.mutate(corpus[pick], corpus[mutator.below(n)]);
    reset_coverage();
    run_one(input);
    if (!reached_something_new()) continue;
    if (n < kMaxCorpus) {
      corpus.push_back(std::move(input));
    } else {
      corpus[seed_count + mutator.below(n - seed_count)] = std::move(input);
    }
  }
  std::printf("%s: %lu inputs, %zu of them kept, %zu branches, no finding\n", kTarget,
              static_cast<unsigned long>(runs), corpus.size() - seed_count, reached_count());
  // A crash ends the process before this line: the row then lacks its figure. So it does where
  // nothing would be noticed but a crash.
  if (kSanitized)
    record({.row = 21,
            .what = std::string(kTarget) + ", findings under ASan and UBSan in " +
                    std::to_string(static_cast<int>(options.seconds)) + " s, of them " +
                    std::to_string(std::clock() / CLOCKS_PER_SEC) + " s of processor time, " +
                    std::to_string(runs) + " inputs, " +
                    std::to_string(corpus.size() - seed_count) +
                    " of them kept for what they reached, branches " +
                    std::to_string(reached_by_seeds) + " by the seeds, " +
                    std::to_string(reached_count()) + " in all",
            .asked = "0",
            .reached = "0",
            .held = true});
  return 0;
}

}  // namespace
}  // namespace pvsfarm::fuzz

int main(int argc, char** argv) {
  using namespace pvsfarm::fuzz;
  watch_for_the_end();
  const Options options = options_of(argc, argv);
  return options.files.empty() ? fuzz(options) : run_files(options.files);
}
