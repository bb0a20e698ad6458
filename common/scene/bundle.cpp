#include "common/scene/bundle.hpp"

#include <array>
#include <bit>
#include <cstring>

#include "common/base/digest.hpp"

namespace pvsfarm {
namespace {
static_assert(std::endian::native == std::endian::little, "records are mapped as they are");
static_assert(sizeof(Vec3) == 24 && sizeof(Triangle) == 12 && sizeof(ObjectId) == 4);

constexpr char kMagic[8] = {'P', 'V', 'S', 'S', 'C', 'E', 'N', 'E'};
constexpr std::size_t kAlignment = 16;
constexpr std::size_t kSectionCount = 12;

struct Preamble {
  char magic[8];
  std::uint32_t version;
  std::uint32_t sections;
  std::uint64_t total_bytes;
  Digest checksum;
  std::uint64_t zero;
};
static_assert(sizeof(Preamble) == 64);

struct Head {
  Box bounds;
  double ground;
  std::uint32_t file_up;
  std::uint32_t zero;
  std::uint64_t section_bytes[kSectionCount];
};
static_assert(sizeof(Head) == 160);

std::size_t aligned(std::size_t offset) { return (offset + kAlignment - 1) & ~(kAlignment - 1); }

// The one list of the sections, in file order: fn(index, span) for each.
template <class Parts, class Fn>
void for_each_section(Parts& parts, Fn&& fn) {
  fn(0, parts.objects);
  fn(1, parts.names);
  fn(2, parts.vertices);
  fn(3, parts.triangles);
  fn(4, parts.occluders);
  fn(5, parts.occluder_points);
  fn(6, parts.occluder_owners);
  fn(7, parts.bvh);
  fn(8, parts.surface_vertices);
  fn(9, parts.surface_edges);
  fn(10, parts.surface_triangles);
  fn(11, parts.surface_components);
}

Error damaged(const std::string& what) {
  return invalid_input("not a usable scene bundle: " + what +
                       "; remove it and import the scene again");
}

Result<Head> read_head(std::span<const std::byte> bytes) {
  if (bytes.size() < sizeof(Preamble) + sizeof(Head)) return damaged("the file is too short");
  Preamble preamble;
  std::memcpy(&preamble, bytes.data(), sizeof preamble);
  if (std::memcmp(preamble.magic, kMagic, sizeof kMagic) != 0) return damaged("wrong file type");
  if (preamble.version != kBundleVersion)
    return damaged("it has version " + std::to_string(preamble.version) + ", this program reads " +
                   std::to_string(kBundleVersion));
  if (preamble.total_bytes != bytes.size())
    return damaged("it should have " + std::to_string(preamble.total_bytes) + " bytes but has " +
                   std::to_string(bytes.size()));
  if (preamble.sections != kSectionCount || preamble.zero != 0) return damaged("broken header");
  if (preamble.checksum != digest_of(bytes.subspan(sizeof preamble)))
    return damaged("its checksum does not match");
  Head head;
  std::memcpy(&head, bytes.data() + sizeof preamble, sizeof head);
  return head;
}
}  // namespace

std::vector<std::byte> write_bundle(const BundleParts& parts) {
  Head head{parts.bounds, parts.ground, static_cast<std::uint32_t>(parts.file_up), 0, {}};
  std::size_t end = sizeof(Preamble) + sizeof(Head);
  for_each_section(parts, [&](std::size_t i, const auto& records) {
    head.section_bytes[i] = records.size_bytes();
    end = aligned(end) + records.size_bytes();
  });

  std::vector<std::byte> bytes(end);  // zeros, hence the padding too
  std::memcpy(bytes.data() + sizeof(Preamble), &head, sizeof head);
  std::size_t offset = sizeof(Preamble) + sizeof(Head);
  for_each_section(parts, [&](std::size_t, const auto& records) {
    offset = aligned(offset);
    if (!records.empty()) std::memcpy(bytes.data() + offset, records.data(), records.size_bytes());
    offset += records.size_bytes();
  });

  Preamble preamble{{}, kBundleVersion, kSectionCount, end, {}, 0};
  std::memcpy(preamble.magic, kMagic, sizeof kMagic);
  preamble.checksum = digest_of(std::span(bytes).subspan(sizeof preamble));
  std::memcpy(bytes.data(), &preamble, sizeof preamble);
  return bytes;
}

Result<BundleParts> read_bundle(std::span<const std::byte> bytes) {
  const Result<Head> head = read_head(bytes);
  if (!head) return head.error();
  if (head->zero != 0 || head->file_up > 1) return damaged("broken header");

  BundleParts parts;
  parts.bounds = head->bounds;
  parts.ground = head->ground;
  parts.file_up = static_cast<UpAxis>(head->file_up);
  std::size_t end = sizeof(Preamble) + sizeof(Head);
  bool fits = true;
  for_each_section(parts, [&](std::size_t i, auto& records) {
    using Span = std::remove_reference_t<decltype(records)>;
    const std::uint64_t size = head->section_bytes[i];
    const std::size_t start = aligned(end);
    if (!fits || start > bytes.size() || size > bytes.size() - start ||
        size % sizeof(typename Span::element_type) != 0) {
      fits = false;
      return;
    }
    records = Span(reinterpret_cast<typename Span::pointer>(bytes.data() + start),
                   size / sizeof(typename Span::element_type));
    end = start + size;
  });
  if (!fits || end != bytes.size()) return damaged("its sections do not fit");
  return parts;
}

}  // namespace pvsfarm
