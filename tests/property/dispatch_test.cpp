// The hot loops are compiled for several instruction sets (worker/visibility/dispatch.hpp), and a
// store must not depend on which of them ran: each gives the same maps and answers, bit for bit.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <sstream>
#include <string>

namespace pvsfarm {
namespace {

std::string output_of(const char* program) {
  FILE* const pipe = popen(program, "r");
  if (pipe == nullptr) return {};
  std::string text;
  std::array<char, 256> part;
  while (fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  return pclose(pipe) == 0 ? text : std::string();
}

TEST(Dispatch, the_loops_of_no_target_give_other_pixels_than_those_the_loader_picks) {
  const std::string picked = output_of(PVSFARM_PIXELS_PICKED);
  std::istringstream lines(picked);
  int count = 0;
  std::string what, digest;
  for (std::uint64_t amount = 0; lines >> what >> amount >> digest; ++count)
    EXPECT_GT(amount, 0u) << what << ": nothing to compare";
  ASSERT_EQ(count, 9) << picked;
  EXPECT_EQ(output_of(PVSFARM_PIXELS_V1), picked) << "portable loops";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    EXPECT_EQ(output_of(PVSFARM_PIXELS_V3), picked) << "AVX2 loops";
  if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512cd"))
    EXPECT_EQ(output_of(PVSFARM_PIXELS_V4), picked) << "AVX-512 loops";
}

}  // namespace
}  // namespace pvsfarm
