// How much a Protobuf body would grow when parsed: an empty sub-message is 2 bytes on the wire and
// some 70 in memory, so they are counted before. Only common/wire includes this.
#pragma once

#include <google/protobuf/descriptor.h>

#include <cstddef>
#include <span>

namespace pvsfarm {

// Fields, of sub-messages too, known or not, of whatever kind: the value of another kind than the
// field's is kept as an unknown one. The largest honest bodies, results of kMaxTaskCells cells and
// reports of kMaxReportedWorkers workers, hold some 30,000 and 60,000.
inline constexpr std::size_t kMaxFields = 131'072;
inline constexpr int kMaxDepth = 8;

// False: too many of them, nested too deep, or not Protobuf at all.
bool grows_little(const google::protobuf::Descriptor& type, std::span<const std::byte> body);

}  // namespace pvsfarm
