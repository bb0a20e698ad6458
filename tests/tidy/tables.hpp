// What may include what. The tables of docs/ARCHITECTURE.md, in a form a program reads.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace pvsfarm::tidy {

// A folder, and what it may include besides itself, separated by blanks; "x/" allows all below x.
// Of several rows that fit, the longest name counts. Not listed, not allowed.
struct FolderRow {
  std::string_view folder;
  std::string_view may_use;
};
inline constexpr FolderRow kFolders[] = {
    {"proto", ""},
    {"common/base", ""},
    {"common/geometry", "common/base"},
    {"common/scene", "common/base common/geometry"},
    {"common/cells", "common/base common/geometry common/scene"},
    {"common/pvs", "common/base common/geometry common/scene common/cells"},
    {"common/wire", "common/base common/geometry common/scene common/cells common/pvs proto"},
    {"worker/render", "common/base common/geometry"},
    {"worker/visibility",
     "common/base common/geometry common/scene common/cells common/pvs worker/render"},
    {"worker/evaluator",
     "common/base common/geometry common/scene common/cells common/pvs worker/visibility "
     "worker/render"},
    {"worker/inquiry",
     "common/base common/geometry common/scene common/cells common/pvs worker/visibility "
     "worker/evaluator"},
    {"worker/service", "common/ worker/evaluator worker/inquiry"},
    {"worker", "common/ worker/"},
    {"coordinator/generate", "common/base common/geometry common/scene common/cells"},
    {"coordinator/picture", "common/base common/geometry common/scene common/cells common/pvs"},
    {"coordinator/chart", "common/base common/geometry common/scene common/cells common/pvs"},
    {"coordinator/tree", "common/base common/geometry common/scene common/cells common/pvs"},
    {"coordinator/board", "common/base common/geometry common/cells common/pvs coordinator/tree"},
    {"coordinator/merger",
     "common/base common/geometry common/scene common/cells common/pvs coordinator/tree "
     "coordinator/journal"},
    {"coordinator/journal", "common/base common/geometry common/scene common/cells common/pvs"},
    {"coordinator/service",
     "common/ coordinator/tree coordinator/board coordinator/merger coordinator/journal"},
    {"coordinator/audit",
     "common/base common/geometry common/scene common/cells common/pvs common/wire "
     "coordinator/service coordinator/board coordinator/tree"},
    {"coordinator/metrics",
     "common/base common/geometry common/scene common/cells common/pvs common/wire"},
    {"coordinator/trace",
     "common/base common/geometry common/scene common/cells common/pvs common/wire "
     "coordinator/service coordinator/board coordinator/tree"},
    {"coordinator/cli", "common/ coordinator/"},
    {"coordinator", "common/ coordinator/"},
    {"tests", "common/ worker/ coordinator/ proto tests/"},
};

// A third-party package: how its includes begin, and the folders or files (prefixes of the path)
// that may hold them, separated by blanks. "*": anywhere. `heavy`: costs seconds a compilation.
struct PackageRow {
  std::string_view package;
  std::string_view headers;
  std::string_view homes;
  bool heavy = false;
};
inline constexpr PackageRow kPackages[] = {
    {"GLM", "glm/", "common/geometry/"},
    {"ZeroMQ", "zmq.hpp zmq.h zmq_addon.hpp", "common/wire/", true},
    {"Protobuf", "google/protobuf/", "common/wire/", true},
    {"OSMesa", "GL/ osmesa", "worker/render/", true},
    {"assimp", "assimp/", "common/scene/", true},
    {"SQLite", "sqlite3.h", "coordinator/journal/"},
    {"Embree", "embree3/", "worker/visibility/ray_scene tests/support/", true},
    {"Recast", "recastnavigation/", "common/cells/"},
    {"libmicrohttpd", "microhttpd.h", "coordinator/metrics/http_server"},
    {"libpng", "png.h", "coordinator/picture/"},
    {"libsodium", "sodium", "common/base/"},
    {"zstd", "zstd.h", "common/pvs/"},
    {"CLI11", "CLI/", "coordinator/cli/ worker/main.cpp tests/bench/", true},
    {"spdlog", "spdlog/",
     "common/base/log coordinator/service/ coordinator/cli/ coordinator/main.cpp worker/service/ "
     "worker/main.cpp",
     true},
    {"nlohmann-json", "nlohmann/", "*", true},
    {"GoogleTest", "gtest/ gmock/", "tests/"},
    {"rapidcheck", "rapidcheck", "tests/"},
    {"Google Benchmark", "benchmark/", "tests/"},
};

// Headers of the compiler and of POSIX; the C++ library's have neither '/' nor ".h".
inline constexpr std::string_view kSystemHeaders =
    "sys/ arpa/ netinet/ linux/ unistd.h fcntl.h poll.h signal.h dlfcn.h sched.h spawn.h dirent.h "
    "errno.h time.h pthread.h termios.h cpuid.h immintrin.h x86intrin.h stdint.h stddef.h string.h "
    "stdlib.h stdio.h stdbool.h math.h assert.h malloc.h";

// Folders of algorithms: functions of what they are given.
inline constexpr std::string_view kPureFolders[] = {
    "common/geometry", "worker/visibility", "worker/evaluator",
    "worker/inquiry",  "coordinator/board", "coordinator/tree",
};
inline constexpr std::string_view kImpureHeaders[] = {
    "fstream",      "iostream",  "cstdio", "filesystem", "thread", "mutex",
    "shared_mutex", "future",    "atomic", "random",     "ctime",  "condition_variable",
    "stop_token",   "semaphore", "latch",  "barrier",
};
// Packages that only compute. Where each may be included is said above.
inline constexpr std::string_view kPurePackages[] = {"glm/", "embree3/"};
inline constexpr std::string_view kImpureCalls[] = {
    "::now(",  "std::rand",   "std::time(", "random_device", "mt19937",
    "fopen(",  "printf(",     "std::cout",  "std::cerr",     "std::clog",
    "getenv(", "std::thread", "spdlog::",   "std::async",
};

inline constexpr std::string_view kTopLevel[] = {
    "CMakeLists.txt",
    "CMakePresets.json",
    "README.md",
    "LICENSE",
    "CHANGELOG.md",
    ".clang-format",
    ".clang-tidy",
    ".gitignore",
    ".ci",
    "common",
    "coordinator",
    "deploy",
    "docs",
    "proto",
    "tests",
    "worker",
};

inline constexpr std::size_t kMaxFileLines = 400;
inline constexpr std::size_t kMaxColumns = 100;

}  // namespace pvsfarm::tidy
