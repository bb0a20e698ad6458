// The rules of docs/ARCHITECTURE.md that a program can check. Each takes the tree and returns what
// breaks it; an empty answer is a pass.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "tests/tidy/source_tree.hpp"

namespace pvsfarm::tidy {

struct Finding {
  std::string path;
  int line = 0;  // 0: the file as a whole
  std::string text;
};
std::ostream& operator<<(std::ostream& out, const Finding& finding);

using Findings = std::vector<Finding>;

// Coordinator and worker never include each other; a folder includes only what the table allows.
Findings folder_edges(const SourceTree& tree);
// No folder includes, through others, itself.
Findings include_cycles(const SourceTree& tree);
// Every third-party package is known, and included only where it lives.
Findings package_homes(const SourceTree& tree);
// Quoted includes are root-relative and exist.
Findings include_paths(const SourceTree& tree);
// Packages that cost seconds a compilation stay out of headers that other folders include.
Findings heavy_headers(const SourceTree& tree);
// Algorithms hold no socket, file, clock, thread, log call or random source of their own.
Findings pure_folders(const SourceTree& tree);
// Files of at most 400 lines, lines of at most 100 columns, no tabs, no trailing blanks.
Findings sizes(const SourceTree& tree);
// No absolute path of the machine somebody worked on.
Findings machine_paths(const SourceTree& tree);
// Only the agreed entries in the root folder.
Findings top_level(const SourceTree& tree);
// Every source file is listed in the CMakeLists.txt of its folder: one that is not is silently
// neither built nor run.
Findings listed_sources(const SourceTree& tree);
// Files and folders that the documents name exist.
Findings document_paths(const SourceTree& tree);

}  // namespace pvsfarm::tidy
