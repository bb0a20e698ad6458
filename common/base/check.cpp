#include "common/base/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace pvsfarm {

void check_failed(const char* file, int line, const char* expression, const std::string& operands) {
  std::fprintf(stderr, "%s:%d: check failed: %s%s%s\n", file, line, expression,
               operands.empty() ? "" : ": ", operands.c_str());
  std::abort();
}

}  // namespace pvsfarm
