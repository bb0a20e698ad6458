// Runs a program as a user does, and keeps what it says.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "common/base/file.hpp"
#include "tests/unit/store_samples.hpp"

namespace pvsfarm {

struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

// `arguments` as typed in a shell, in `folder`.
inline ProgramRun run_pvsfarm(const TempFolder& folder, const std::string& arguments) {
  const std::string command = "cd '" + folder.file("") + "' && { '" PVSFARM_PROGRAM "' " +
                              arguments + "; } >.stdout 2>.stderr </dev/null";
  const int status = std::system(command.c_str());
  return {.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1,
          .out = *read_file(folder.file(".stdout")),
          .err = *read_file(folder.file(".stderr"))};
}

}  // namespace pvsfarm
