// Every rule can fail: small offending trees, each beside its innocent twin.
#include <gtest/gtest.h>

#include "tests/tidy/rules.hpp"

namespace pvsfarm::tidy {
namespace {

SourceTree tree_of(std::vector<SourceFile> files) { return {std::move(files), {}}; }

SourceTree one(std::string path, std::string_view text) {
  return tree_of({file_from_text(std::move(path), text)});
}

std::string only_text(const Findings& findings) {
  return findings.size() == 1 ? findings[0].text : std::to_string(findings.size()) + " findings";
}

TEST(TidyRules, CoordinatorMayNotIncludeWorker) {
  EXPECT_EQ(only_text(folder_edges(
                one("coordinator/service/a.cpp", "#include \"worker/evaluator/evaluator.hpp\"\n"))),
            "coordinator/service may not include worker/evaluator");
  EXPECT_EQ(only_text(folder_edges(
                one("worker/service/a.cpp", "#include \"coordinator/board/board.hpp\"\n"))),
            "worker/service may not include coordinator/board");
}

TEST(TidyRules, LowerFolderMayNotIncludeHigher) {
  EXPECT_EQ(folder_edges(one("common/base/a.hpp", "#include \"common/pvs/delta.hpp\"\n")).size(),
            1u);
  EXPECT_TRUE(folder_edges(one("common/pvs/a.hpp", "#include \"common/base/ids.hpp\"\n")).empty());
  EXPECT_TRUE(folder_edges(one("worker/main.cpp", "#include \"worker/service/s.hpp\"\n")).empty());
}

TEST(TidyRules, UnknownFolderIsFound) {
  EXPECT_EQ(only_text(folder_edges(one("common/misc/a.cpp", "int x;\n"))),
            "folder common/misc is not in the table of folders");
}

TEST(TidyRules, CircleIsFound) {
  const Findings found = include_cycles(tree_of({
      file_from_text("coordinator/tree/a.hpp", "#include \"coordinator/board/b.hpp\"\n"),
      file_from_text("coordinator/board/b.hpp", "#include \"coordinator/merger/c.hpp\"\n"),
      file_from_text("coordinator/merger/c.hpp", "#include \"coordinator/tree/a.hpp\"\n"),
  }));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(found[0].text.find("coordinator/tree"), std::string::npos);
  EXPECT_TRUE(include_cycles(tree_of({
                                 file_from_text("a/a.hpp", "#include \"b/b.hpp\"\n"),
                                 file_from_text("c/c.hpp", "#include \"b/b.hpp\"\n"),
                             }))
                  .empty());
}

TEST(TidyRules, PackageOutsideItsHome) {
  EXPECT_EQ(only_text(package_homes(one("worker/visibility/a.cpp", "#include <GL/osmesa.h>\n"))),
            "OSMesa is included only in worker/render/");
  EXPECT_EQ(package_homes(one("worker/service/a.cpp", "#include \"farm.pb.h\"\n")).size(), 1u);
  EXPECT_TRUE(package_homes(one("worker/render/a.cpp", "#  include <GL/osmesa.h>\n")).empty());
}

TEST(TidyRules, PackageNobodyDeclared) {
  EXPECT_EQ(only_text(package_homes(one("common/base/a.cpp", "#include <boost/any.hpp>\n"))),
            "<boost/any.hpp> belongs to no package of the table");
  EXPECT_TRUE(package_homes(one("common/base/a.cpp", "#include <sys/mman.h>\n#include <vector>\n"))
                  .empty());
}

TEST(TidyRules, IncludeRelativeToTheFile) {
  EXPECT_EQ(include_paths(one("common/base/a.cpp", "#include \"check.hpp\"\n")).size(), 1u);
  EXPECT_TRUE(include_paths(tree_of({file_from_text("common/base/check.hpp", ""),
                                     file_from_text("common/base/a.cpp",
                                                    "#include \"common/base/check.hpp\"\n")}))
                  .empty());
}

TEST(TidyRules, HeavyHeaderLeavesItsFolder) {
  const SourceFile heavy = file_from_text("common/wire/a.hpp", "#include \"farm.pb.h\"\n");
  const SourceFile middle = file_from_text("common/wire/b.hpp", "#include \"common/wire/a.hpp\"\n");
  const SourceFile inside = file_from_text("common/wire/c.cpp", "#include \"common/wire/b.hpp\"\n");
  const SourceFile outside =
      file_from_text("worker/service/d.cpp", "#include \"common/wire/b.hpp\"\n");
  EXPECT_TRUE(heavy_headers(tree_of({heavy, middle, inside})).empty());
  EXPECT_EQ(only_text(heavy_headers(tree_of({heavy, middle, inside, outside}))),
            "common/wire/b.hpp brings Protobuf, which is heavy: keep it within its folder");
  const SourceFile light =
      file_from_text("common/wire/b.hpp", "#include <nlohmann/json_fwd.hpp>\n");
  EXPECT_TRUE(heavy_headers(tree_of({light, inside, outside})).empty());
}

TEST(TidyRules, AlgorithmThatIsNoFunction) {
  const char* offences[] = {
      "#include <fstream>\n",
      "#include <thread>\n",
      "#include <random>\n",
      "#include <unistd.h>\n",
      "const auto t = std::chrono::steady_clock::now();\n",
      "int x = 0; printf(\"%d\", x);\n",
      "std::cerr << 1;\n",
  };
  for (const char* text : offences) {
    EXPECT_EQ(pure_folders(one("worker/visibility/a.cpp", text)).size(), 1u) << text;
    EXPECT_TRUE(pure_folders(one("worker/service/a.cpp", text)).empty()) << text;
  }
  EXPECT_TRUE(
      pure_folders(one("coordinator/board/a.cpp",
                       "#include <chrono>\n#include <immintrin.h>\n#include <embree3/rtcore.h>\n"
                       "// std::cerr << would be wrong\n"
                       "const char* s = \"std::cerr\"; /* steady_clock::now( */\n"))
          .empty());
}

TEST(TidyRules, FileTooLong) {
  std::string text;
  for (int i = 0; i < 400; ++i) text += "int x;\n";
  EXPECT_TRUE(sizes(one("common/base/a.cpp", text)).empty());
  EXPECT_EQ(only_text(sizes(one("common/base/a.cpp", text + "\n"))), "401 lines: split it");
}

TEST(TidyRules, LineTooWide) {
  const std::string wide(101, 'x');
  EXPECT_EQ(only_text(sizes(one("common/base/a.hpp", wide + "\n"))), "101 columns");
  EXPECT_TRUE(sizes(one("common/base/a.hpp", wide.substr(1) + "\n")).empty());
  EXPECT_TRUE(sizes(one("docs/a.md", wide + "\n")).empty());
  EXPECT_EQ(only_text(sizes(one("deploy/a.sh", "a\tb\n"))), "a tab");
  EXPECT_EQ(only_text(sizes(one("deploy/a.sh", "a \n"))), "trailing blank");
}

TEST(TidyRules, PathOfOneMachine) {
  const std::string home = std::string("/ho") + "me/ann/scene.obj";
  EXPECT_EQ(machine_paths(one("tests/run.sh", "cp " + home + " .\n")).size(), 1u);
  EXPECT_EQ(machine_paths(one("docs/a.md", home + "\n")).size(), 1u);
  EXPECT_TRUE(machine_paths(one("docs/a.md", "see tests/farm/faults.cpp\n")).empty());
}

TEST(TidyRules, StrangerInTheRootFolder) {
  EXPECT_EQ(only_text(top_level({{}, {"README.md", "scratch"}})),
            "is not among the agreed entries of the root folder");
  EXPECT_TRUE(top_level({{}, {"README.md", "worker"}}).empty());
}

TEST(TidyRules, SourceFileNobodyBuilds) {
  const auto with = [](std::string_view cmake_text) {
    return tree_of({file_from_text("tests/unit/CMakeLists.txt", cmake_text),
                    file_from_text("tests/unit/a_test.cpp", "int x;\n"),
                    file_from_text("tests/unit/a.hpp", "int y;\n")});
  };
  EXPECT_TRUE(listed_sources(with("pvsfarm_test(a LABEL unit\n  SOURCES a_test.cpp)\n")).empty());
  const char* offences[] = {
      "",
      "pvsfarm_test(a SOURCES b_a_test.cpp a_test.cpp.in LIBRARIES a_test)\n",
      "# pvsfarm_test(a SOURCES a_test.cpp)\n",
  };
  for (const char* text : offences)
    EXPECT_EQ(only_text(listed_sources(with(text))),
              "is not listed in the CMakeLists.txt of its folder")
        << text;
  // Another folder's list does not count.
  EXPECT_EQ(listed_sources(tree_of({file_from_text("tests/CMakeLists.txt", "add(a.c)\n"),
                                    file_from_text("tests/unit/a.c", "int x;\n")}))
                .size(),
            1u);
}

TEST(TidyRules, DocumentNamesWhatIsGone) {
  EXPECT_EQ(only_text(document_paths(one("docs/a.md", "see `worker/visibility/gone.cpp`\n"))),
            "worker/visibility/gone.cpp does not exist");
  EXPECT_EQ(only_text(document_paths(one("docs/a.md", "see [it](adr/0001.md)\n"))),
            "adr/0001.md does not exist");
  EXPECT_TRUE(document_paths(tree_of({
                                 file_from_text("docs/a.md", "`docs/adr/` [x](adr/b.md)\n"),
                                 file_from_text("docs/adr/b.md", "[up](../a.md) [r](../../R.md)\n"),
                                 file_from_text("R.md", "[out](https://example.org/x) `a/b`\n"),
                             }))
                  .empty());
}

TEST(TidyRules, CodeLinesBlankCommentsAndStrings) {
  const SourceFile file =
      file_from_text("a.cpp", "a; // b\n\"c \\\" d\" e\n/* f\ng */ h 1'000 i\n");
  EXPECT_EQ(code_lines(file), (std::vector<std::string>{"a; ", "\"\" e", "", " h 1'000 i"}));
}

}  // namespace
}  // namespace pvsfarm::tidy
