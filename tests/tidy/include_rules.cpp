// Rules about what includes what.
#include <algorithm>
#include <functional>
#include <map>
#include <ostream>
#include <set>

#include "tests/tidy/rules.hpp"
#include "tests/tidy/tables.hpp"

namespace pvsfarm::tidy {
namespace {

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (end > 0) out.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

bool starts_with_any(std::string_view text, std::string_view prefixes) {
  const auto all = words(prefixes);
  return std::any_of(all.begin(), all.end(),
                     [&](std::string_view prefix) { return text.starts_with(prefix); });
}

bool is_generated(std::string_view include) { return include.ends_with(".pb.h"); }

// The row with the longest name that `folder` is or lies below.
const FolderRow* row_of(std::string_view folder) {
  const FolderRow* best = nullptr;
  for (const FolderRow& row : kFolders) {
    const bool fits = folder == row.folder ||
                      (folder.starts_with(row.folder) && folder[row.folder.size()] == '/');
    if (fits && (!best || row.folder.size() > best->folder.size())) best = &row;
  }
  return best;
}

bool may_include(const FolderRow& row, std::string_view to) {
  if (row_of(to) == &row) return true;
  for (const std::string_view allowed : words(row.may_use)) {
    if (allowed.ends_with('/')
            ? to.starts_with(allowed) || to == allowed.substr(0, allowed.size() - 1)
            : to == allowed)
      return true;
  }
  return false;
}

const PackageRow* package_of(std::string_view include) {
  for (const PackageRow& row : kPackages)
    if (starts_with_any(include, row.headers)) return &row;
  return nullptr;
}

// Generated code counts as Protobuf.
const PackageRow* third_party(const Include& include) {
  if (is_generated(include.name)) return package_of("google/protobuf/");
  return include.angled ? package_of(include.name) : nullptr;
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const Finding& finding) {
  out << finding.path;
  if (finding.line > 0) out << ':' << finding.line;
  return out << ": " << finding.text;
}

Findings folder_edges(const SourceTree& tree) {
  Findings found;
  for (const SourceFile& file : tree.files) {
    if (!is_cpp(file)) continue;
    const std::string from = folder_of(file.path);
    const FolderRow* row = row_of(from);
    if (!row) {
      found.push_back({file.path, 0, "folder " + from + " is not in the table of folders"});
      continue;
    }
    for (const Include& include : includes_of(file)) {
      if (include.angled || is_generated(include.name)) continue;
      const std::string to = folder_of(include.name);
      if (to == from || may_include(*row, to)) continue;
      found.push_back({file.path, include.line, from + " may not include " + to});
    }
  }
  return found;
}

Findings include_cycles(const SourceTree& tree) {
  std::map<std::string, std::map<std::string, std::string>> edges;  // from, to, an example
  for (const SourceFile& file : tree.files) {
    if (!is_cpp(file)) continue;
    for (const Include& include : includes_of(file)) {
      const std::string from = folder_of(file.path), to = folder_of(include.name);
      if (!include.angled && to != from)
        edges[from].emplace(to, file.path + ":" + std::to_string(include.line));
    }
  }
  Findings found;
  std::set<std::string> done;
  std::vector<std::string> path;
  const std::function<void(const std::string&)> visit = [&](const std::string& folder) {
    const auto seen = std::find(path.begin(), path.end(), folder);
    if (seen != path.end()) {
      std::string text = "folders include each other in a circle:";
      for (auto it = seen; it != path.end(); ++it) text += " " + *it + " ->";
      found.push_back({edges[path.back()][folder], 0, text + " " + folder});
      return;
    }
    if (done.contains(folder)) return;
    path.push_back(folder);
    if (const auto it = edges.find(folder); it != edges.end())
      for (const auto& [to, example] : std::map(it->second)) visit(to);
    path.pop_back();
    done.insert(folder);
  };
  for (const auto& [from, to] : std::map(edges)) visit(from);
  return found;
}

Findings package_homes(const SourceTree& tree) {
  Findings found;
  for (const SourceFile& file : tree.files) {
    if (!is_cpp(file)) continue;
    for (const Include& include : includes_of(file)) {
      const PackageRow* row = third_party(include);
      if (row) {
        if (row->homes != "*" && !starts_with_any(file.path, row->homes))
          found.push_back(
              {file.path, include.line,
               std::string(row->package) + " is included only in " + std::string(row->homes)});
      } else if (include.angled && include.name.find_first_of("/.") != std::string::npos &&
                 !starts_with_any(include.name, kSystemHeaders)) {
        found.push_back(
            {file.path, include.line, "<" + include.name + "> belongs to no package of the table"});
      }
    }
  }
  return found;
}

Findings include_paths(const SourceTree& tree) {
  std::set<std::string_view> known;
  for (const SourceFile& file : tree.files) known.insert(file.path);
  Findings found;
  for (const SourceFile& file : tree.files) {
    if (!is_cpp(file)) continue;
    for (const Include& include : includes_of(file)) {
      if (include.angled || is_generated(include.name) || known.contains(include.name)) continue;
      found.push_back({file.path, include.line,
                       "\"" + include.name + "\" is no file, seen from the project's root"});
    }
  }
  return found;
}

Findings heavy_headers(const SourceTree& tree) {
  // Which headers of ours drag a heavy package along, and which one.
  std::map<std::string, std::string> heavy;
  for (bool grew = true; grew;) {
    grew = false;
    for (const SourceFile& file : tree.files) {
      if (!file.path.ends_with(".hpp") || heavy.contains(file.path)) continue;
      for (const Include& include : includes_of(file)) {
        const PackageRow* row = third_party(include);
        std::string package;
        if (row && row->heavy && !include.name.ends_with("_fwd.hpp")) package = row->package;
        if (const auto it = heavy.find(include.name); it != heavy.end()) package = it->second;
        if (package.empty()) continue;
        heavy[file.path] = package;
        grew = true;
        break;
      }
    }
  }
  Findings found;
  for (const SourceFile& file : tree.files) {
    if (!is_cpp(file) || file.path.starts_with("tests/")) continue;
    for (const Include& include : includes_of(file)) {
      const auto it = heavy.find(include.name);
      if (it == heavy.end() || folder_of(file.path) == folder_of(include.name)) continue;
      found.push_back(
          {file.path, include.line,
           include.name + " brings " + it->second + ", which is heavy: keep it within its folder"});
    }
  }
  return found;
}

}  // namespace pvsfarm::tidy
