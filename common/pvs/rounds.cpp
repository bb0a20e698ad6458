#include "common/pvs/rounds.hpp"

#include <algorithm>

#include "common/base/check.hpp"
#include "common/pvs/field_bytes.hpp"

namespace pvsfarm {
namespace {

// The one list of fields, for both directions; but for the method.
template <class Bytes, class Round>
void visit(Bytes& bytes, Round& r) {
  bytes.field(r.maps.planes);
  bytes.field(r.maps.resolution_px);
  if (r.maps.planes > 0) {
    bytes.field(r.maps.occluders);
    bytes.field(r.maps.nearest_m);
    bytes.field(r.maps.farthest_m);
    bytes.field(r.maps.extent);
  }
  bytes.field(r.open_objects);
  bytes.field(r.open_triangles);
  bytes.field(r.hidden_objects);
  bytes.field(r.seen_objects);
  bytes.field(r.hidden_triangles);
  bytes.field(r.seen_triangles);
  bytes.field(r.work);
  bytes.field(r.cpu_ms);
}

void add_to(CascadeRound& sum, const CascadeRound& round) {
  if (round.maps.planes > 0 && sum.maps.planes > 0)
    sum.maps.nearest_m = std::min(sum.maps.nearest_m, round.maps.nearest_m);
  else
    sum.maps.nearest_m = std::max(sum.maps.nearest_m, round.maps.nearest_m);
  sum.maps.planes += round.maps.planes;
  sum.maps.resolution_px = std::max(sum.maps.resolution_px, round.maps.resolution_px);
  sum.maps.occluders = std::max(sum.maps.occluders, round.maps.occluders);
  sum.maps.farthest_m = std::max(sum.maps.farthest_m, round.maps.farthest_m);
  sum.maps.extent = std::max(sum.maps.extent, round.maps.extent);
  sum.hidden_objects += round.hidden_objects;
  sum.seen_objects += round.seen_objects;
  sum.hidden_triangles += round.hidden_triangles;
  sum.seen_triangles += round.seen_triangles;
  sum.work += round.work;
  sum.cpu_ms += round.cpu_ms;
}

}  // namespace

// Every method keeps room for a round of its own.
void append_round(std::vector<CascadeRound>& rounds, const CascadeRound& round) {
  if (rounds.size() >= kMaxRounds - kMethodCount) {
    const auto same = [&](const CascadeRound& other) { return other.method == round.method; };
    const auto last = std::find_if(rounds.rbegin(), rounds.rend(), same);
    if (last != rounds.rend()) return add_to(*last, round);
  }
  rounds.push_back(round);
}

std::vector<std::byte> encode_rounds(std::span<const CascadeRound> rounds) {
  PVS_CHECK_LE(rounds.size(), kMaxRounds);
  FieldWriter writer;
  writer.field(std::uint64_t{rounds.size()});
  for (const CascadeRound& round : rounds) {
    writer.field(static_cast<std::uint64_t>(round.method));
    visit(writer, round);
  }
  const std::span<const std::byte> bytes = writer.bytes.bytes();
  return {bytes.begin(), bytes.end()};
}

bool decode_rounds(std::span<const std::byte> bytes, std::vector<CascadeRound>& out) {
  out.clear();
  FieldReader reader(bytes);
  std::uint64_t count = 0;
  reader.field(count);
  reader.refuse_unless(count <= kMaxRounds);
  for (; reader.whole() && count > 0; --count) {
    std::uint64_t method = 0;
    reader.field(method);
    reader.refuse_unless(method < kMethodCount);
    CascadeRound& round = out.emplace_back();
    round.method = static_cast<Method>(method);
    visit(reader, round);
    for (const float x :
         {round.maps.nearest_m, round.maps.farthest_m, round.maps.extent, round.cpu_ms})
      reader.refuse_unless(x >= 0);
  }
  return reader.done();
}

}  // namespace pvsfarm
