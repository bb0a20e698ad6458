// Draws a Vega-Lite specification with the program vl2svg of the npm package vega-lite
// (deploy/install.sh --charts).
#pragma once

#include <string>

#include "common/base/result.hpp"

namespace pvsfarm {

struct DrawRequest {
  std::string spec;     // JSON text
  std::string svg;      // the file to write, whole or not at all
  std::string program;  // vl2svg: a path, or a name to look for in PATH
};
// Errors: kUnsupported (no such program), kRuntime (it fails), kIo.
Status draw_svg(const DrawRequest& request);

}  // namespace pvsfarm
