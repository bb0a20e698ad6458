// The project obeys its own rules. Findings print as FILE:LINE: what is wrong.
#include <gtest/gtest.h>

#include "tests/tidy/rules.hpp"

namespace pvsfarm::tidy {
namespace {

const SourceTree& project() {
  static const SourceTree tree = read_tree(PVSFARM_SOURCE_DIR);
  return tree;
}

void expect_none(const Findings& findings) {
  for (const Finding& finding : findings) ADD_FAILURE() << finding;
}

TEST(Tidy, TheTreeIsThere) {
  EXPECT_GT(project().files.size(), 50u);
  std::size_t includes = 0;
  for (const SourceFile& file : project().files) includes += includes_of(file).size();
  EXPECT_GT(includes, 100u);
}
TEST(Tidy, FoldersIncludeOnlyWhatTheTableAllows) { expect_none(folder_edges(project())); }
TEST(Tidy, NoFolderIncludesItselfThroughOthers) { expect_none(include_cycles(project())); }
TEST(Tidy, EachPackageIsIncludedInItsHomeOnly) { expect_none(package_homes(project())); }
TEST(Tidy, QuotedIncludesAreRootRelative) { expect_none(include_paths(project())); }
TEST(Tidy, HeavyHeadersStayInTheirFolder) { expect_none(heavy_headers(project())); }
TEST(Tidy, AlgorithmsAreFunctions) { expect_none(pure_folders(project())); }
TEST(Tidy, FilesAreSmall) { expect_none(sizes(project())); }
TEST(Tidy, NoPathOfOneMachine) { expect_none(machine_paths(project())); }
TEST(Tidy, RootFolderHoldsWhatWasAgreed) { expect_none(top_level(project())); }
TEST(Tidy, EverySourceFileIsBuilt) { expect_none(listed_sources(project())); }
TEST(Tidy, DocumentsNameFilesThatExist) { expect_none(document_paths(project())); }

}  // namespace
}  // namespace pvsfarm::tidy
