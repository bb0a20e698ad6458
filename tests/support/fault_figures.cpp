#include "tests/support/fault_figures.hpp"

#include <cerrno>  // program_invocation_short_name
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

namespace pvsfarm {

bool full_counts() {
  const char* full = std::getenv("PVSFARM_FULL");
  return full != nullptr && *full != '\0' && std::string(full) != "0";
}

void record(const FaultFigure& figure) {
  const char* path = std::getenv("PVSFARM_FIGURES");
  if (path == nullptr) return;
  const nlohmann::json line{{"row", figure.row},
                            {"what", figure.what},
                            {"asked", figure.asked},
                            {"reached", figure.reached},
                            {"held", figure.held},
                            {"full", full_counts()},
                            {"test", program_invocation_short_name}};
  // One write of a whole line: tests of several processes share the file.
  std::ofstream(path, std::ios::app) << line.dump() + "\n" << std::flush;
}

}  // namespace pvsfarm
