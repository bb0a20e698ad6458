#include "common/pvs/hints_file.hpp"

#include <algorithm>
#include <cstring>

#include "common/base/file.hpp"
#include "common/pvs/pvs_load.h"
#include "common/pvs/store_bytes.hpp"

namespace pvsfarm {
namespace {

constexpr char kMagic[8] = {'P', 'V', 'S', 'H', 'I', 'N', 'T', 'S'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeadBytes = 16, kDigestBytes = 32;
constexpr std::size_t kTailBytes = 8 + 2 * kDigestBytes;

std::span<const std::byte> bytes_of(const Digest& digest) {
  return std::as_bytes(std::span(digest.bytes));
}

}  // namespace

Result<std::unique_ptr<HintsWriter>> HintsWriter::create(const std::string& path,
                                                         std::uint32_t viewpoints) {
  auto file = AtomicFile::create(path);
  if (!file) return file.error();
  std::unique_ptr<HintsWriter> writer(new HintsWriter(std::move(file).value()));
  ByteWriter head;
  head.put_bytes(std::as_bytes(std::span(kMagic)));
  head.put_u32(kVersion);
  head.put_u32(viewpoints);
  if (Status status = writer->write(head.bytes()); !status) return status.error();
  return writer;
}

Status HintsWriter::write(std::span<const std::byte> bytes) {
  digest_.add(bytes);
  return file_->write(bytes);
}

Status HintsWriter::add(std::span<const std::byte> row) {
  PVS_CHECK_EQ(row.size() % 2, 0u);
  ends_.push_back((ends_.empty() ? 0 : ends_.back()) + row.size());
  return write(row);
}

Status HintsWriter::finish(const Digest& store) {
  ByteWriter tail;
  for (const std::uint64_t end : ends_) tail.put_u64(end);
  tail.put_u32(static_cast<std::uint32_t>(ends_.size()));
  tail.put_u32(0);
  tail.put_bytes(bytes_of(store));
  if (Status status = write(tail.bytes()); !status) return status;
  if (Status status = file_->write(bytes_of(digest_.finish())); !status) return status;
  return file_->commit();
}

Result<HintsReader> HintsReader::open(const std::string& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return text.error();
  const auto all = std::as_bytes(std::span(*text));
  const auto* raw = reinterpret_cast<const unsigned char*>(all.data());
  if (all.size() < kHeadBytes + kTailBytes || std::memcmp(raw, kMagic, sizeof kMagic) != 0)
    return invalid_input(path + ": no file of hints, or cut short; bake with --hints");
  if (load_u32(raw + 8) != kVersion)
    return Error{ErrorKind::kUnsupported, path + ": hints of format " +
                                              std::to_string(load_u32(raw + 8)) +
                                              ", this program reads " + std::to_string(kVersion)};
  const Error damaged = invalid_input(path + ": damaged; bake with --hints again");
  const auto body = all.first(all.size() - kDigestBytes);
  if (std::memcmp(digest_of(body).bytes.data(), raw + body.size(), kDigestBytes) != 0)
    return damaged;

  HintsReader reader;
  reader.viewpoints_ = load_u32(raw + 12);
  const unsigned char* tail = raw + all.size() - kTailBytes;
  const std::uint64_t nodes = load_u32(tail), space = all.size() - kHeadBytes - kTailBytes;
  if (nodes * 8 > space) return damaged;
  std::memcpy(reader.store_.bytes.data(), tail + 8, kDigestBytes);
  const std::uint64_t row_bytes = space - nodes * 8;
  for (std::uint64_t node = 0; node < nodes; ++node)
    reader.ends_.push_back(load_u64(raw + kHeadBytes + row_bytes + 8 * node));
  const bool fits = nodes == 0 ? row_bytes == 0 : reader.ends_.back() == row_bytes;
  if (!fits || !std::is_sorted(reader.ends_.begin(), reader.ends_.end())) return damaged;
  const auto rows = all.subspan(kHeadBytes, row_bytes);
  reader.rows_.assign(rows.begin(), rows.end());
  return reader;
}

Result<HintsReader> read_hints(const StoreReader& store) {
  const std::string path = hints_path(store.path());
  Result<HintsReader> hints = HintsReader::open(path);
  if (!hints) return hints;
  if (hints->store() != store.digest() || hints->node_count() != store.node_count())
    return invalid_input(path + ": hints of another store; bake with --hints again");
  return hints;
}

std::span<const std::byte> HintsReader::row(std::uint32_t node) const {
  PVS_CHECK_LT(node, ends_.size());
  const std::uint64_t from = node == 0 ? 0 : ends_[node - 1];
  return std::span(rows_).subspan(from, ends_[node] - from);
}

}  // namespace pvsfarm
