// The full check of a store: every byte against checksums and digest, then everything a reader may
// rely on.
#pragma once

#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

// Ok if the store is whole and right:
//   every block has its checksum and the file its digest;
//   cells stand in canonical order, parents hold their children, leaves are those without any;
//   seen is in visible, a child's visible in its parent's;
//   every root and only roots can be located.
// Errors: kIo, kUnsupported, kInvalidInput naming the damage and its byte offset. Reads all of it;
// memory: a set for each level of the hierarchy.
Status validate_store(const std::string& path);

}  // namespace pvsfarm
