// Rules about what files say, and where they lie.
#include <algorithm>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "tests/tidy/rules.hpp"
#include "tests/tidy/tables.hpp"

namespace pvsfarm::tidy {
namespace {

bool lies_in(const SourceFile& file, std::string_view folder) {
  return file.path.starts_with(folder) && file.path[folder.size()] == '/';
}

bool is_impure_header(const std::string& name) {
  if (std::find(std::begin(kImpureHeaders), std::end(kImpureHeaders), name) !=
      std::end(kImpureHeaders))
    return true;
  for (const std::string_view package : kPurePackages)
    if (name.starts_with(package)) return false;
  // Of the system's headers, only the compiler's own vector instructions are functions.
  return (name.ends_with(".h") || name.find('/') != std::string::npos) &&
         !name.ends_with("intrin.h") && name != "cpuid.h";
}

// Prose, data and pictures have lines as long as they need.
bool has_width_limit(const SourceFile& file) {
  return is_cpp(file) || file.path.ends_with(".sh") || file.path.ends_with(".proto") ||
         file.path.ends_with("CMakeLists.txt");
}

// The words of a line of CMake up to its comment.
std::vector<std::string> cmake_words(const std::string& line) {
  std::string code = line.substr(0, line.find('#'));
  std::replace_if(
      code.begin(), code.end(), [](char c) { return c == '(' || c == ')'; }, ' ');
  std::istringstream words(code);
  return {std::istream_iterator<std::string>(words), {}};
}

std::size_t columns_of(const std::string& line) {
  return static_cast<std::size_t>(
      std::count_if(line.begin(), line.end(), [](char c) { return (c & '\xC0') != '\x80'; }));
}

}  // namespace

Findings pure_folders(const SourceTree& tree) {
  Findings found;
  for (const SourceFile& file : tree.files) {
    const bool pure = std::any_of(std::begin(kPureFolders), std::end(kPureFolders),
                                  [&](std::string_view folder) { return lies_in(file, folder); });
    if (!pure || !is_cpp(file)) continue;
    for (const Include& include : includes_of(file))
      if (include.angled && is_impure_header(include.name))
        found.push_back(
            {file.path, include.line, "an algorithm may not use <" + include.name + ">"});
    const std::vector<std::string> code = code_lines(file);
    for (std::size_t i = 0; i < code.size(); ++i)
      for (const std::string_view call : kImpureCalls)
        if (code[i].find(call) != std::string::npos)
          found.push_back({file.path, static_cast<int>(i) + 1,
                           "an algorithm may not use " + std::string(call)});
  }
  return found;
}

Findings sizes(const SourceTree& tree) {
  Findings found;
  for (const SourceFile& file : tree.files) {
    if (!has_width_limit(file)) continue;
    if (file.lines.size() > kMaxFileLines)
      found.push_back({file.path, 0, std::to_string(file.lines.size()) + " lines: split it"});
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string& line = file.lines[i];
      const int number = static_cast<int>(i) + 1;
      if (columns_of(line) > kMaxColumns)
        found.push_back({file.path, number, std::to_string(columns_of(line)) + " columns"});
      if (line.find('\t') != std::string::npos) found.push_back({file.path, number, "a tab"});
      if (line.ends_with(' ')) found.push_back({file.path, number, "trailing blank"});
    }
  }
  return found;
}

Findings machine_paths(const SourceTree& tree) {
  static const std::regex pattern(
      R"((^|[^A-Za-z0-9_./}>*-])/(home|root|work|tmp|farm|Users)/[A-Za-z.])");
  Findings found;
  for (const SourceFile& file : tree.files)
    for (std::size_t i = 0; i < file.lines.size(); ++i)
      if (std::regex_search(file.lines[i], pattern))
        found.push_back({file.path, static_cast<int>(i) + 1, "an absolute path of one machine"});
  return found;
}

Findings top_level(const SourceTree& tree) {
  Findings found;
  for (const std::string& name : tree.top_level)
    if (std::find(std::begin(kTopLevel), std::end(kTopLevel), name) == std::end(kTopLevel))
      found.push_back({name, 0, "is not among the agreed entries of the root folder"});
  return found;
}

Findings listed_sources(const SourceTree& tree) {
  std::set<std::string> listed;  // paths
  for (const SourceFile& file : tree.files) {
    if (!file.path.ends_with("/CMakeLists.txt")) continue;
    for (const std::string& line : file.lines)
      for (const std::string& word : cmake_words(line))
        listed.insert(folder_of(file.path) + "/" + word);
  }
  Findings found;
  for (const SourceFile& file : tree.files)
    if ((file.path.ends_with(".cpp") || file.path.ends_with(".c")) && !listed.contains(file.path))
      found.push_back({file.path, 0, "is not listed in the CMakeLists.txt of its folder"});
  return found;
}

Findings document_paths(const SourceTree& tree) {
  std::set<std::string> known;
  for (const SourceFile& file : tree.files) {
    known.insert(file.path);
    for (std::string folder = folder_of(file.path); !folder.empty(); folder = folder_of(folder))
      known.insert(folder);
  }
  // `worker/visibility/a.cpp` and `common/geometry/` between backquotes; ](adr/0001.md) in links.
  static const std::regex quoted(
      R"(`((common|worker|coordinator|proto|tests|deploy|docs)/[A-Za-z0-9_./-]*)`)");
  static const std::regex linked(R"(\]\(([A-Za-z0-9_./-]+)\))");
  Findings found;
  for (const SourceFile& file : tree.files) {
    if (!file.path.ends_with(".md")) continue;
    const auto check = [&](const std::string& line, int number, const std::regex& pattern,
                           const std::string& folder) {
      for (std::sregex_iterator it(line.begin(), line.end(), pattern), end; it != end; ++it) {
        std::string target = (*it)[1];
        if (target.ends_with('/')) target.pop_back();
        std::string base = folder;
        while (target.starts_with("../")) target.erase(0, 3), base = folder_of(base);
        if (!base.empty()) target.insert(0, base + "/");
        if (!known.contains(target))
          found.push_back({file.path, number, (*it)[1].str() + " does not exist"});
      }
    };
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      check(file.lines[i], static_cast<int>(i) + 1, quoted, "");
      check(file.lines[i], static_cast<int>(i) + 1, linked, folder_of(file.path));
    }
  }
  return found;
}

}  // namespace pvsfarm::tidy
