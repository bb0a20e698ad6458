#include "coordinator/journal/row_bytes.hpp"

#include "common/pvs/field_bytes.hpp"

namespace pvsfarm {
namespace {

// The one list of fields, for both directions.
template <class Bytes, class Statistics>
void visit(Bytes& bytes, Statistics& s) {
  bytes.field(s.cpu_ms);
  bytes.field(s.planes);
  bytes.field(s.occluder_candidates);
  bytes.field(s.projections);
  bytes.field(s.occluders_skipped);
  bytes.field(s.box_tests);
  bytes.field(s.contradictions);
  for (auto& method : s.methods) {
    bytes.field(method.hidden_objects);
    bytes.field(method.seen_objects);
    bytes.field(method.hidden_triangles);
    bytes.field(method.seen_triangles);
    bytes.field(method.work);
    bytes.field(method.cpu_ms);
  }
}

}  // namespace

std::vector<std::byte> encode(const CellStatistics& statistics) {
  FieldWriter writer;
  visit(writer, statistics);
  writer.bytes.put_bytes(encode_rounds(statistics.rounds));
  const std::span<const std::byte> bytes = writer.bytes.bytes();
  return {bytes.begin(), bytes.end()};
}

bool decode_statistics(std::span<const std::byte> bytes, CellStatistics& out) {
  FieldReader reader(bytes);
  visit(reader, out);
  return reader.whole() && decode_rounds(reader.rest(), out.rounds);
}

// Lengths first, so that no byte can move from one set to the other.
Digest delta_digest(const ResultRow& row) {
  return DigestBuilder()
      .add_u64(row.key.root)
      .add_u64(row.key.path)
      .add_u64(row.hidden.size())
      .add(row.hidden)
      .add_u64(row.seen.size())
      .add(row.seen)
      .add_u64(row.point_triangles)
      .add_u64(row.hints.size())
      .add(row.hints)
      .finish();
}

}  // namespace pvsfarm
