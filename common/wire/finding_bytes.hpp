// The answer to one question of an inquiry as bytes: what follows a FINDING_BEGIN.
#pragma once

#include <span>
#include <variant>

#include "common/base/result.hpp"
#include "common/pvs/inquiry.hpp"
#include "common/wire/messages.hpp"

namespace pvsfarm {

inline constexpr std::size_t kMaxFindingBytes = 16 * 1024 * 1024;
inline constexpr std::size_t kMaxOwners = 4096;  // of one blocker

using WireFinding = std::variant<AuditFinding, ExplainFinding>;

// What exceeds a limit is cut off.
Bytes encode_finding(const AuditFinding& finding);
Bytes encode_finding(const ExplainFinding& finding);

// Errors: kInvalidInput (too long, does not parse, over a limit, an object past `object_count`, a
// number that is none).
Result<WireFinding> decode_finding(std::span<const std::byte> bytes, std::uint32_t object_count);

}  // namespace pvsfarm
