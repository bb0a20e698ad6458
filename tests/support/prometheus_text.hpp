// Reads Prometheus' text format 0.0.4 and says what breaks its rules, as `promtool check metrics`
// would.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace pvsfarm {

struct PrometheusText {
  std::map<std::string, double> values;  // by name and labels, as written
  std::vector<std::string> errors;       // none: fine
};
PrometheusText read_prometheus(const std::string& text);

}  // namespace pvsfarm
