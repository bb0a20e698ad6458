#include "coordinator/chart/draw.hpp"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "common/base/file.hpp"

namespace pvsfarm {
namespace {

// What the program reads and writes, removed afterwards.
struct Scratch {
  explicit Scratch(const std::string& beside) : spec(beside + ".vl.tmp"), svg(beside + ".tmp") {}
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove(spec, ignored);
    std::filesystem::remove(svg, ignored);
  }
  std::string spec, svg;
};

Error no_program(const std::string& program) {
  return {ErrorKind::kUnsupported,
          program +
              ": no such program to draw with; `bash deploy/install.sh --charts` installs it "
              "as build/charts/node_modules/.bin/vl2svg, or draw the specification elsewhere"};
}

}  // namespace

Status draw_svg(const DrawRequest& request) {
  const Scratch scratch(request.svg);
  if (Status written = write_file(scratch.spec, request.spec); !written) return written;
  std::string program = request.program, spec = scratch.spec, svg = scratch.svg;
  char* const arguments[] = {program.data(), spec.data(), svg.data(), nullptr};
  pid_t pid = 0;
  const int failed = posix_spawnp(&pid, program.c_str(), nullptr, nullptr, arguments, ::environ);
  if (failed == ENOENT) return no_program(program);
  if (failed != 0) return runtime_error(program + ": cannot run: " + std::strerror(failed));
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) return no_program(program);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return runtime_error(program + ": could not draw " + request.svg);
  const auto drawn = read_file(scratch.svg);
  if (!drawn) return runtime_error(program + ": said it drew " + request.svg + ", but did not");
  return write_file(request.svg, *drawn);
}

}  // namespace pvsfarm
