// An off-screen OpenGL context on the CPU: Mesa's OSMesa with llvmpipe.
//
// Measured: contexts of one process share a rasteriser mutex, so a process has one at work, without
// threads of its own; context 4 ms, first shader 22 ms, 30 MiB.
// Threads: create and use on one thread. The object made last is current, until another's
// make_current (0.2 us where it is current already).
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace pvsfarm {

class OsmesaContext {
 public:
  // Makes a 4.5 core context current. Aborts if the installed Mesa cannot: a broken installation.
  OsmesaContext();
  ~OsmesaContext();
  OsmesaContext(const OsmesaContext&) = delete;
  OsmesaContext& operator=(const OsmesaContext&) = delete;

  void make_current();
  // The address of a GL function: not every one is exported by the library.
  template <class Function>
  Function load(const char* name) const {
    return reinterpret_cast<Function>(address(name));
  }
  // Compiles and links a program (its GL name) and puts it to use. Aborts if Mesa refuses it.
  std::uint32_t use_program(const char* vertex_shader, const char* fragment_shader) const;
  // Version of the renderer; part of the kernel id, as another Mesa may rasterise differently.
  static std::string mesa_version();

 private:
  using Address = void (*)();
  Address address(const char* name) const;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm
