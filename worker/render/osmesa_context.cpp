#include "worker/render/osmesa_context.hpp"

#define GL_GLEXT_PROTOTYPES 0
#include <GL/osmesa.h>
// After osmesa.h, which needs GL's own types.
#include <GL/glext.h>

#include <cstdlib>
#include <utility>

#include "common/base/check.hpp"

#ifdef __SANITIZE_ADDRESS__
// Mesa keeps a hundred bytes of every context for good; the leak checker is told whose they are.
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }
extern "C" const char* __lsan_default_options() { return "print_suppressions=0"; }
#endif

namespace pvsfarm {

struct OsmesaContext::State {
  OSMesaContext context = nullptr;
  std::uint32_t unused_pixel = 0;  // the default framebuffer: drawing goes to framebuffer objects
};

OsmesaContext::OsmesaContext() : state_(std::make_unique<State>()) {
  ::setenv("LP_NUM_THREADS", "0", 1);
  // Two small shaders are not worth files in the user's home, which a container may not even have.
  ::setenv("MESA_SHADER_CACHE_DISABLE", "true", 0);
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            4,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            5,
                            0};
  state_->context = OSMesaCreateContextAttribs(attributes, nullptr);
  PVS_CHECK(state_->context != nullptr);
  make_current();
}

OsmesaContext::~OsmesaContext() { OSMesaDestroyContext(state_->context); }

void OsmesaContext::make_current() {
  PVS_CHECK(OSMesaMakeCurrent(state_->context, &state_->unused_pixel, GL_UNSIGNED_BYTE, 1, 1));
}

OsmesaContext::Address OsmesaContext::address(const char* name) const {
  const Address found = OSMesaGetProcAddress(name);
  PVS_CHECK(found != nullptr);
  return found;
}

std::uint32_t OsmesaContext::use_program(const char* vertex_shader,
                                         const char* fragment_shader) const {
  const auto attach = load<PFNGLATTACHSHADERPROC>("glAttachShader");
  const auto compile = load<PFNGLCOMPILESHADERPROC>("glCompileShader");
  const GLuint program = load<PFNGLCREATEPROGRAMPROC>("glCreateProgram")();
  const std::pair<GLenum, const char*> parts[] = {{GL_VERTEX_SHADER, vertex_shader},
                                                  {GL_FRAGMENT_SHADER, fragment_shader}};
  for (const auto& [kind, source] : parts) {
    const GLuint shader = load<PFNGLCREATESHADERPROC>("glCreateShader")(kind);
    load<PFNGLSHADERSOURCEPROC>("glShaderSource")(shader, 1, &source, nullptr);
    compile(shader);
    GLint compiled = 0;
    load<PFNGLGETSHADERIVPROC>("glGetShaderiv")(shader, GL_COMPILE_STATUS, &compiled);
    PVS_CHECK(compiled == GL_TRUE);
    attach(program, shader);
  }
  load<PFNGLLINKPROGRAMPROC>("glLinkProgram")(program);
  load<PFNGLUSEPROGRAMPROC>("glUseProgram")(program);
  return program;
}

std::string OsmesaContext::mesa_version() {
  const OsmesaContext context;
  const auto get_string = context.load<const GLubyte* (*)(GLenum)>("glGetString");
  return reinterpret_cast<const char*>(get_string(GL_VERSION));
}

}  // namespace pvsfarm
