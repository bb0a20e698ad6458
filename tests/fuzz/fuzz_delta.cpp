// Sets as they come with tasks and results, and rows of the journal.
#include "common/pvs/visible_set.hpp"
#include "coordinator/journal/row_bytes.hpp"
#include "tests/fuzz/driver.hpp"

namespace pvsfarm::fuzz {

const char* const kTarget = "delta";
const std::size_t kMaxInput = 4096;

namespace {

constexpr std::uint32_t kUniverse = 1u << 20;

Input with(std::uint8_t kind, const std::vector<std::byte>& bytes) {
  Input input{kind};
  for (const std::byte b : bytes) input.push_back(static_cast<std::uint8_t>(b));
  return input;
}

}  // namespace

std::vector<Input> seeds() {
  VisibleSet some = VisibleSet::all(1000);
  for (std::uint32_t i = 0; i < 1000; i += 3) some.remove(ObjectId{i});
  CellStatistics statistics{.cpu_ms = 2.5, .planes = 12};
  statistics.methods[2] = {.hidden_objects = 4, .work = 1ull << 40};
  return {with(0, encode(some)), with(0, encode(VisibleSet::none(77))),
          with(0, encode(VisibleSet::all(kUniverse))), with(1, encode(statistics))};
}

void run(std::span<const std::uint8_t> input) {
  if (input.empty()) return;
  const std::span<const std::byte> rest = std::as_bytes(input.subspan(1));
  if (input[0] == 1) {
    CellStatistics statistics;
    (void)decode_statistics(rest, statistics);
    return;
  }
  const Result<VisibleSet> set = decode_visible_set(rest, kUniverse);
  if (!set) return;
  PVS_CHECK_LE(set->universe(), kUniverse);
  // Canonical: no other bytes mean this set, or digests would not tell sets apart.
  const std::vector<std::byte> again = encode(*set);
  PVS_CHECK(std::equal(again.begin(), again.end(), rest.begin(), rest.end()));
}

}  // namespace pvsfarm::fuzz
