#include "worker/render/item_buffer.hpp"

#define GL_GLEXT_PROTOTYPES 0
#include <GL/gl.h>
#include <GL/glext.h>

#include <cstddef>
#include <vector>

#include "common/base/check.hpp"
#include "worker/render/osmesa_context.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kVertexShader = R"(#version 330 core
layout(location = 0) in vec3 from_eye;
layout(location = 1) in uint item_in;
uniform int axis;
uniform float sign;
uniform float near;
flat out uint item;
void main() {
  item = item_in;
  vec3 p = axis == 0 ? from_eye.xyz : axis == 1 ? from_eye.yzx : from_eye.zxy;
  gl_Position = vec4(p.yz, near, sign * p.x);
})";
constexpr const char* kFragmentShader = R"(#version 330 core
flat in uint item;
out uint nearest;
void main() { nearest = item; })";

}  // namespace

struct ItemBuffer::State {
  OsmesaContext context;
  int side = 0;
  std::vector<std::uint32_t> pixels;
  GLint axis = -1, sign = -1, near = -1;

  template <class Function>
  Function load(const char* name) const {
    return context.load<Function>(name);
  }

  PFNGLBUFFERDATAPROC buffer_data = load<PFNGLBUFFERDATAPROC>("glBufferData");
  PFNGLCLEARBUFFERFVPROC clear_floats = load<PFNGLCLEARBUFFERFVPROC>("glClearBufferfv");
  PFNGLCLEARBUFFERUIVPROC clear_integers = load<PFNGLCLEARBUFFERUIVPROC>("glClearBufferuiv");
  PFNGLUNIFORM1IPROC uniform_int = load<PFNGLUNIFORM1IPROC>("glUniform1i");
  PFNGLUNIFORM1FPROC uniform_float = load<PFNGLUNIFORM1FPROC>("glUniform1f");
  void (*draw_arrays)(GLenum, GLint,
                      GLsizei) = load<void (*)(GLenum, GLint, GLsizei)>("glDrawArrays");
  void (*read_pixels)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*) =
      load<void (*)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*)>("glReadPixels");
  GLenum (*get_error)() = load<GLenum (*)()>("glGetError");

  void make_program();
  void attach(GLenum attachment, GLenum format) const;
  void make_framebuffer();
  void make_vertex_array();
};

void ItemBuffer::State::make_program() {
  const GLuint program = context.use_program(kVertexShader, kFragmentShader);
  const auto location = load<PFNGLGETUNIFORMLOCATIONPROC>("glGetUniformLocation");
  axis = location(program, "axis");
  sign = location(program, "sign");
  near = location(program, "near");
}

void ItemBuffer::State::attach(GLenum attachment, GLenum format) const {
  GLuint buffer = 0;
  load<PFNGLGENRENDERBUFFERSPROC>("glGenRenderbuffers")(1, &buffer);
  load<PFNGLBINDRENDERBUFFERPROC>("glBindRenderbuffer")(GL_RENDERBUFFER, buffer);
  load<PFNGLRENDERBUFFERSTORAGEPROC>("glRenderbufferStorage")(GL_RENDERBUFFER, format, side, side);
  load<PFNGLFRAMEBUFFERRENDERBUFFERPROC>("glFramebufferRenderbuffer")(GL_FRAMEBUFFER, attachment,
                                                                      GL_RENDERBUFFER, buffer);
}

void ItemBuffer::State::make_framebuffer() {
  GLuint framebuffer = 0;
  load<PFNGLGENFRAMEBUFFERSPROC>("glGenFramebuffers")(1, &framebuffer);
  load<PFNGLBINDFRAMEBUFFERPROC>("glBindFramebuffer")(GL_FRAMEBUFFER, framebuffer);
  attach(GL_COLOR_ATTACHMENT0, GL_R32UI);
  attach(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F);
  PVS_CHECK(load<PFNGLCHECKFRAMEBUFFERSTATUSPROC>("glCheckFramebufferStatus")(GL_FRAMEBUFFER) ==
            GL_FRAMEBUFFER_COMPLETE);
  load<void (*)(GLint, GLint, GLsizei, GLsizei)>("glViewport")(0, 0, side, side);
  const auto enable = load<void (*)(GLenum)>("glEnable");
  enable(GL_DEPTH_TEST);
  load<void (*)(GLenum)>("glDepthFunc")(GL_GREATER);
  load<PFNGLCLIPCONTROLPROC>("glClipControl")(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
  load<void (*)(GLenum, GLint)>("glPixelStorei")(GL_PACK_ALIGNMENT, 4);
}

void ItemBuffer::State::make_vertex_array() {
  GLuint array = 0, buffer = 0;
  load<PFNGLGENVERTEXARRAYSPROC>("glGenVertexArrays")(1, &array);
  load<PFNGLBINDVERTEXARRAYPROC>("glBindVertexArray")(array);
  load<PFNGLGENBUFFERSPROC>("glGenBuffers")(1, &buffer);
  load<PFNGLBINDBUFFERPROC>("glBindBuffer")(GL_ARRAY_BUFFER, buffer);
  const auto enable = load<PFNGLENABLEVERTEXATTRIBARRAYPROC>("glEnableVertexAttribArray");
  load<PFNGLVERTEXATTRIBPOINTERPROC>("glVertexAttribPointer")(0, 3, GL_FLOAT, GL_FALSE,
                                                              sizeof(ItemVertex), nullptr);
  load<PFNGLVERTEXATTRIBIPOINTERPROC>("glVertexAttribIPointer")(
      1, 1, GL_UNSIGNED_INT, sizeof(ItemVertex),
      reinterpret_cast<const void*>(offsetof(ItemVertex, item)));
  enable(0);
  enable(1);
}

ItemBuffer::ItemBuffer(int side_px) : state_(std::make_unique<State>()) {
  state_->side = side_px;
  state_->pixels.resize(static_cast<std::size_t>(side_px) * static_cast<std::size_t>(side_px));
  state_->make_framebuffer();
  state_->make_program();
  state_->make_vertex_array();
  PVS_CHECK_EQ(state_->get_error(), static_cast<GLenum>(GL_NO_ERROR));
}

ItemBuffer::~ItemBuffer() = default;

int ItemBuffer::side_px() const { return state_->side; }

std::span<const std::uint32_t> ItemBuffer::draw(const ItemView& view, float near,
                                                std::span<const ItemVertex> triangles) {
  State& s = *state_;
  s.context.make_current();
  const GLuint none[4] = {kNoItem, 0, 0, 0};
  const float farthest = 0;
  s.clear_integers(GL_COLOR, 0, none);
  s.clear_floats(GL_DEPTH, 0, &farthest);
  s.uniform_int(s.axis, view.axis);
  s.uniform_float(s.sign, view.sign);
  s.uniform_float(s.near, near);
  s.buffer_data(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(triangles.size_bytes()), triangles.data(),
                GL_STREAM_DRAW);
  s.draw_arrays(GL_TRIANGLES, 0, static_cast<GLsizei>(triangles.size()));
  s.read_pixels(0, 0, s.side, s.side, GL_RED_INTEGER, GL_UNSIGNED_INT, s.pixels.data());
  PVS_CHECK_EQ(s.get_error(), static_cast<GLenum>(GL_NO_ERROR));
  return s.pixels;
}

}  // namespace pvsfarm
