#include "coordinator/journal/row_bytes.hpp"

#include <bit>
#include <cmath>
#include <limits>

#include "common/pvs/store_bytes.hpp"

namespace pvsfarm {
namespace {

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  void field(double& out) {
    std::uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) bits |= next() << (8 * i);
    out = std::bit_cast<double>(bits);
    if (!std::isfinite(out)) whole_ = false;
  }
  void field(std::uint64_t& out) {
    out = 0;
    for (int shift = 0;; shift += 7) {
      const std::uint64_t byte = next();
      if (shift == 63 && byte > 1) whole_ = false;
      out |= (byte & 0x7f) << shift;
      if (byte < 0x80 || !whole_) return;
    }
  }
  void field(std::uint32_t& out) {
    std::uint64_t wide = 0;
    field(wide);
    if (wide > std::numeric_limits<std::uint32_t>::max()) whole_ = false;
    out = static_cast<std::uint32_t>(wide);
  }
  bool done() const { return whole_ && bytes_.empty(); }

 private:
  std::uint64_t next() {
    if (bytes_.empty()) whole_ = false;
    if (!whole_) return 0;
    const auto byte = std::to_integer<std::uint64_t>(bytes_.front());
    bytes_ = bytes_.subspan(1);
    return byte;
  }

  std::span<const std::byte> bytes_;
  bool whole_ = true;
};

struct Writer {
  ByteWriter bytes;
  void field(const double& value) { bytes.put_f64(value); }
  void field(const std::uint64_t& value) { bytes.put_varint(value); }
  void field(const std::uint32_t& value) { bytes.put_varint(value); }
};

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
  Writer writer;
  visit(writer, statistics);
  const std::span<const std::byte> bytes = writer.bytes.bytes();
  return {bytes.begin(), bytes.end()};
}

bool decode_statistics(std::span<const std::byte> bytes, CellStatistics& out) {
  Reader reader(bytes);
  visit(reader, out);
  return reader.done();
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
