// The text of the project as the style rules read it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pvsfarm::tidy {

struct SourceFile {
  std::string path;  // from the project's root, with '/'
  std::vector<std::string> lines;
};

struct Include {
  std::string name;  // between the quotes or the angle brackets
  bool angled = false;
  int line = 0;  // from 1
};

struct SourceTree {
  std::vector<SourceFile> files;       // by path; binary files have no lines
  std::vector<std::string> top_level;  // names in the root folder
};

// Everything under `root` but .git and build.
SourceTree read_tree(const std::string& root);

SourceFile file_from_text(std::string path, std::string_view text);
bool is_cpp(const SourceFile& file);
std::vector<Include> includes_of(const SourceFile& file);
std::string folder_of(std::string_view path);  // "worker/visibility" of "worker/visibility/a.cpp"

// The lines with comments and the insides of string literals blanked, so that rules about code do
// not meet prose. Raw strings are not understood: what they hold counts as code.
std::vector<std::string> code_lines(const SourceFile& file);

}  // namespace pvsfarm::tidy
