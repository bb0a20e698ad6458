#include "coordinator/cli/cell_times.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace pvsfarm {

Result<std::vector<double>> read_cell_times(const std::string& store_path, std::uint32_t cells) {
  std::vector<double> times_ms(cells, 0.0);
  const std::string path = store_path + ".stats";
  if (!std::filesystem::exists(path)) return times_ms;
  std::ifstream file(path);
  if (!file) return io_error(path + ": cannot be read: " + std::strerror(errno));
  std::string line;
  for (std::size_t number = 1; std::getline(file, line); ++number) {
    const auto entry = nlohmann::json::parse(line, nullptr, false);
    const bool ok = entry.is_object() && entry.contains("cell") && entry.contains("ms") &&
                    entry["cell"].is_number_unsigned() && entry["ms"].is_number() &&
                    entry["cell"].get<std::uint64_t>() < cells;
    if (!ok)
      return invalid_input(path + ": line " + std::to_string(number) +
                           ": is no {\"cell\":N,\"ms\":T} of this store; remove the file (times "
                           "will read 0) or bake again");
    times_ms[entry["cell"].get<std::uint32_t>()] = entry["ms"].get<double>();
  }
  if (file.bad()) return io_error(path + ": cannot be read: " + std::strerror(errno));
  return times_ms;
}

}  // namespace pvsfarm
