#include "tests/tidy/source_tree.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace pvsfarm::tidy {
namespace fs = std::filesystem;

SourceTree read_tree(const std::string& root) {
  SourceTree tree;
  for (const auto& entry : fs::directory_iterator(root)) {
    const std::string name = entry.path().filename().string();
    if (name == ".git" || name == "build") continue;
    tree.top_level.push_back(name);
    if (entry.is_regular_file()) {
      std::ifstream in(entry.path(), std::ios::binary);
      tree.files.push_back(file_from_text(name, std::string(std::istreambuf_iterator(in), {})));
      continue;
    }
    for (const auto& inner : fs::recursive_directory_iterator(entry.path())) {
      if (!inner.is_regular_file()) continue;
      std::ifstream in(inner.path(), std::ios::binary);
      tree.files.push_back(file_from_text(fs::relative(inner.path(), root).generic_string(),
                                          std::string(std::istreambuf_iterator(in), {})));
    }
  }
  std::sort(tree.top_level.begin(), tree.top_level.end());
  std::sort(tree.files.begin(), tree.files.end(),
            [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return tree;
}

SourceFile file_from_text(std::string path, std::string_view text) {
  SourceFile file{std::move(path), {}};
  if (text.find('\0') != std::string_view::npos) return file;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    file.lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return file;
}

bool is_cpp(const SourceFile& file) {
  const std::string_view path = file.path;
  return path.ends_with(".cpp") || path.ends_with(".hpp") || path.ends_with(".h") ||
         path.ends_with(".c");
}

std::vector<Include> includes_of(const SourceFile& file) {
  std::vector<Include> found;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    const std::string& line = file.lines[i];
    std::size_t at = line.find_first_not_of(" \t");
    if (at == std::string::npos || line[at] != '#') continue;
    at = line.find_first_not_of(" \t", at + 1);
    if (at == std::string::npos || line.compare(at, 7, "include") != 0) continue;
    const std::size_t open = line.find_first_of("<\"", at);
    if (open == std::string::npos) continue;
    const std::size_t close = line.find(line[open] == '<' ? '>' : '"', open + 1);
    if (close == std::string::npos) continue;
    found.push_back(
        {line.substr(open + 1, close - open - 1), line[open] == '<', static_cast<int>(i) + 1});
  }
  return found;
}

std::string folder_of(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string_view::npos ? "" : std::string(path.substr(0, slash));
}

std::vector<std::string> code_lines(const SourceFile& file) {
  std::vector<std::string> out;
  bool in_block_comment = false;
  for (const std::string& line : file.lines) {
    std::string code;
    char quote = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const bool has_next = i + 1 < line.size();
      if (in_block_comment) {
        if (line[i] == '*' && has_next && line[i + 1] == '/') in_block_comment = false, ++i;
      } else if (quote != 0) {
        if (line[i] == '\\')
          ++i;
        else if (line[i] == quote)
          code += quote, quote = 0;
      } else if (line[i] == '/' && has_next && line[i + 1] == '/') {
        break;
      } else if (line[i] == '/' && has_next && line[i + 1] == '*') {
        in_block_comment = true, ++i;
      } else {
        code += line[i];
        const bool digit_separator =
            line[i] == '\'' && i > 0 && std::isxdigit(static_cast<unsigned char>(line[i - 1]));
        if (line[i] == '"' || (line[i] == '\'' && !digit_separator)) quote = line[i];
      }
    }
    out.push_back(code);
  }
  return out;
}

}  // namespace pvsfarm::tidy
