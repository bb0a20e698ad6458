// Always-on checks: a broken invariant aborts and prints its operands.
#pragma once

#include <sstream>
#include <string>

namespace pvsfarm {

[[noreturn]] void check_failed(const char* file, int line, const char* expression,
                               const std::string& operands);

template <class A, class B>
std::string check_operands(const A& a, const B& b) {
  std::ostringstream out;
  out << a << " against " << b;
  return out.str();
}

}  // namespace pvsfarm

#define PVS_CHECK(condition)                                                     \
  do {                                                                           \
    if (!(condition)) ::pvsfarm::check_failed(__FILE__, __LINE__, #condition, ""); \
  } while (false)
#define PVS_CHECK_OP(a, op, b)                                            \
  do {                                                                    \
    if (!((a)op(b)))                                                      \
      ::pvsfarm::check_failed(__FILE__, __LINE__, #a " " #op " " #b,      \
                              ::pvsfarm::check_operands((a), (b)));       \
  } while (false)
#define PVS_CHECK_EQ(a, b) PVS_CHECK_OP(a, ==, b)
#define PVS_CHECK_LT(a, b) PVS_CHECK_OP(a, <, b)
#define PVS_CHECK_LE(a, b) PVS_CHECK_OP(a, <=, b)
