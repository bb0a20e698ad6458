// CRC-32C (Castagnoli), as RFC 3720 has it: finds damage on the way, proves nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace pvsfarm {

std::uint32_t crc32c(std::span<const std::byte> data);

}  // namespace pvsfarm
