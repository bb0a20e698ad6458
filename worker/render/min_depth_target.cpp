#include "worker/render/min_depth_target.hpp"

#define GL_GLEXT_PROTOTYPES 0
#include <GL/gl.h>
#include <GL/glext.h>

#include <limits>

#include "common/base/check.hpp"
#include "worker/render/osmesa_context.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kVertexShader = R"(#version 330 core
layout(location = 0) in vec3 window;
uniform float two_over_side;
flat out float depth;
void main() {
  depth = window.z;
  gl_Position = vec4(window.xy * two_over_side - 1.0, 0.0, 1.0);
})";
constexpr const char* kFragmentShader = R"(#version 330 core
flat in float depth;
out float least;
void main() { least = depth; })";

}  // namespace

struct MinDepthTarget::State {
  OsmesaContext context;
  int side = 0;
  std::vector<float> pixels;
  GLuint buffer = 0, framebuffer = 0, texture = 0, array = 0;

  template <class Function>
  Function load(const char* name) const {
    return context.load<Function>(name);
  }

  PFNGLBINDBUFFERPROC bind_buffer = load<PFNGLBINDBUFFERPROC>("glBindBuffer");
  PFNGLBUFFERDATAPROC buffer_data = load<PFNGLBUFFERDATAPROC>("glBufferData");
  PFNGLCLEARBUFFERFVPROC clear_buffer = load<PFNGLCLEARBUFFERFVPROC>("glClearBufferfv");
  void (*draw_arrays)(GLenum, GLint,
                      GLsizei) = load<void (*)(GLenum, GLint, GLsizei)>("glDrawArrays");
  void (*read_pixels)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*) =
      load<void (*)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*)>("glReadPixels");
  GLenum (*get_error)() = load<GLenum (*)()>("glGetError");

  void make_program();
  void make_framebuffer();
  void make_vertex_array();
};

void MinDepthTarget::State::make_program() {
  const GLuint program = context.use_program(kVertexShader, kFragmentShader);
  const GLint scale =
      load<PFNGLGETUNIFORMLOCATIONPROC>("glGetUniformLocation")(program, "two_over_side");
  load<PFNGLUNIFORM1FPROC>("glUniform1f")(scale, 2.0f / static_cast<float>(side));
}

void MinDepthTarget::State::make_framebuffer() {
  load<PFNGLGENFRAMEBUFFERSPROC>("glGenFramebuffers")(1, &framebuffer);
  load<PFNGLBINDFRAMEBUFFERPROC>("glBindFramebuffer")(GL_FRAMEBUFFER, framebuffer);
  load<PFNGLGENRENDERBUFFERSPROC>("glGenRenderbuffers")(1, &texture);
  load<PFNGLBINDRENDERBUFFERPROC>("glBindRenderbuffer")(GL_RENDERBUFFER, texture);
  load<PFNGLRENDERBUFFERSTORAGEPROC>("glRenderbufferStorage")(GL_RENDERBUFFER, GL_R32F, side, side);
  load<PFNGLFRAMEBUFFERRENDERBUFFERPROC>("glFramebufferRenderbuffer")(
      GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, texture);
  PVS_CHECK(load<PFNGLCHECKFRAMEBUFFERSTATUSPROC>("glCheckFramebufferStatus")(GL_FRAMEBUFFER) ==
            GL_FRAMEBUFFER_COMPLETE);
  load<void (*)(GLint, GLint, GLsizei, GLsizei)>("glViewport")(0, 0, side, side);
  load<void (*)(GLenum)>("glDisable")(GL_DITHER);
  load<void (*)(GLenum)>("glEnable")(GL_BLEND);
  load<PFNGLBLENDEQUATIONPROC>("glBlendEquation")(GL_MIN);
  load<void (*)(GLenum, GLint)>("glPixelStorei")(GL_PACK_ALIGNMENT, 4);
}

void MinDepthTarget::State::make_vertex_array() {
  load<PFNGLGENVERTEXARRAYSPROC>("glGenVertexArrays")(1, &array);
  load<PFNGLBINDVERTEXARRAYPROC>("glBindVertexArray")(array);
  load<PFNGLGENBUFFERSPROC>("glGenBuffers")(1, &buffer);
  bind_buffer(GL_ARRAY_BUFFER, buffer);
  load<PFNGLVERTEXATTRIBPOINTERPROC>("glVertexAttribPointer")(0, 3, GL_FLOAT, GL_FALSE,
                                                              sizeof(WindowVertex), nullptr);
  load<PFNGLENABLEVERTEXATTRIBARRAYPROC>("glEnableVertexAttribArray")(0);
}

MinDepthTarget::MinDepthTarget(int side_px) : state_(std::make_unique<State>()) {
  state_->side = side_px;
  state_->pixels.resize(static_cast<std::size_t>(side_px) * side_px);
  state_->make_framebuffer();
  state_->make_program();
  state_->make_vertex_array();
  PVS_CHECK_EQ(state_->get_error(), static_cast<GLenum>(GL_NO_ERROR));
}

MinDepthTarget::~MinDepthTarget() = default;

std::span<const float> MinDepthTarget::draw(std::span<const WindowVertex> triangles) {
  State& s = *state_;
  s.context.make_current();
  const float infinity[4] = {std::numeric_limits<float>::infinity(), 0, 0, 0};
  s.clear_buffer(GL_COLOR, 0, infinity);
  s.buffer_data(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(triangles.size_bytes()), triangles.data(),
                GL_STREAM_DRAW);
  s.draw_arrays(GL_TRIANGLES, 0, static_cast<GLsizei>(triangles.size()));
  s.read_pixels(0, 0, s.side, s.side, GL_RED, GL_FLOAT, s.pixels.data());
  PVS_CHECK_EQ(s.get_error(), static_cast<GLenum>(GL_NO_ERROR));
  return s.pixels;
}

}  // namespace pvsfarm
