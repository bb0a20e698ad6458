#include "tests/support/prometheus_text.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

namespace pvsfarm {
namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

class Reader {
 public:
  PrometheusText read(const std::string& text) {
    if (!text.empty() && text.back() != '\n') error("the last line does not end");
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (line.rfind("# HELP ", 0) == 0)
        help(line);
      else if (line.rfind("# TYPE ", 0) == 0)
        type(line);
      else
        sample(line);
    }
    finish_metric();
    return std::move(result_);
  }

 private:
  void error(const std::string& text) { result_.errors.push_back(text); }

  void help(const std::string& line) {
    finish_metric();
    static const std::regex kHelp("# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) (.+)");
    std::smatch match;
    if (!std::regex_match(line, match, kHelp)) return error("no help: " + line);
    name_ = match[1];
    if (!names_.insert(name_).second) error("twice: " + name_);
  }

  void type(const std::string& line) {
    static const std::regex kType("# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram)");
    std::smatch match;
    if (!std::regex_match(line, match, kType)) return error("no type: " + line);
    if (match[1] != name_) error("a type without its help: " + line);
    type_ = match[2];
    if ((type_ == "counter") != ends_with(name_, "_total")) error("not a counter's name: " + name_);
  }

  void sample(const std::string& line) {
    static const std::regex kSample(
        R"re(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{([a-zA-Z_][a-zA-Z0-9_]*="[^"\\]*",?)*\})? ([^ ]+))re");
    std::smatch match;
    if (!std::regex_match(line, match, kSample)) return error("not a sample: " + line);
    const std::string name = match[1], labels = match[2], number = match[4];
    const bool own = name == name_ ||
                     (type_ == "histogram" && (name == name_ + "_bucket" ||
                                               name == name_ + "_sum" || name == name_ + "_count"));
    if (!own || type_.empty()) error("not below its head: " + line);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    if (*end != '\0' || !std::isfinite(value)) return error("not a number: " + line);
    if (type_ != "gauge" && value < 0) error("a counter below zero: " + line);
    if (!result_.values.emplace(name + labels, value).second) error("twice: " + line);
    if (name == name_ + "_bucket") bucket(labels, value);
  }

  void bucket(const std::string& labels, double value) {
    static const std::regex kBound("\\{le=\"([^\"]+)\"\\}");
    std::smatch match;
    if (!std::regex_match(labels, match, kBound)) return error("a bucket without a bound");
    const double bound =
        match[1] == "+Inf" ? std::numeric_limits<double>::infinity() : std::stod(match[1]);
    if (bound <= bound_ || value < count_) error("buckets that do not grow: " + name_);
    bound_ = bound;
    count_ = value;
  }

  void finish_metric() {
    if (type_ == "histogram") {
      if (!std::isinf(bound_)) error("no bucket for all: " + name_);
      const auto count = result_.values.find(name_ + "_count");
      if (count == result_.values.end() || count->second != count_) error("count of " + name_);
      if (result_.values.count(name_ + "_sum") == 0) error("no sum of " + name_);
    }
    type_.clear();
    bound_ = -std::numeric_limits<double>::infinity();
    count_ = 0;
  }

  PrometheusText result_;
  std::set<std::string> names_;
  std::string name_, type_;
  double bound_ = -std::numeric_limits<double>::infinity(), count_ = 0;
};

}  // namespace

PrometheusText read_prometheus(const std::string& text) { return Reader().read(text); }

}  // namespace pvsfarm
