#include "common/pvs/method.hpp"

namespace pvsfarm {
namespace {
constexpr std::array<const char*, kMethodCount> kNames{
    "look-around", "aimed-rays", "item-buffers", "projection", "fine-projection",
    "surfaces",    "improved",   "slices",       "sweep",      "shafts"};
}  // namespace

const char* to_string(Method method) { return kNames[static_cast<std::size_t>(method)]; }

std::optional<Method> method_named(std::string_view name) {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i]) return static_cast<Method>(i);
  return std::nullopt;
}

}  // namespace pvsfarm
