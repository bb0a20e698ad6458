#include "tests/support/stencil_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/check.hpp"
#include "tests/support/view_polygon.hpp"
#include "worker/render/osmesa_context.hpp"

namespace pvsfarm {
namespace {

// The few names of OpenGL that this file needs; its headers belong to worker/render.
using Enum = unsigned;
using Name = unsigned;
constexpr Enum kDepthBufferBit = 0x100, kStencilBufferBit = 0x400, kTriangleFan = 6;
constexpr Enum kLess = 0x201, kEqual = 0x202, kAlways = 0x207;
constexpr Enum kKeep = 0x1E00, kReplace = 0x1E01;
constexpr Enum kDepthTest = 0x0B71, kStencilTest = 0x0B90;
constexpr Enum kFloat = 0x1406, kDepthComponent = 0x1902, kDepth32fStencil8 = 0x8CAD;
constexpr Enum kFramebuffer = 0x8D40, kRenderbuffer = 0x8D41, kDepthStencilAttachment = 0x821A;
constexpr Enum kFramebufferComplete = 0x8CD5, kArrayBuffer = 0x8892, kStreamDraw = 0x88E0;
constexpr Enum kVertexShader = 0x8B31, kFragmentShader = 0x8B30, kLinkStatus = 0x8B82;
constexpr int kViews = 8;
constexpr unsigned kAllBits = 0xff;

constexpr const char* kVertexSource = R"(#version 330 core
layout(location = 0) in vec2 window;
uniform float two_over_side, depth;
void main() { gl_Position = vec4(window * two_over_side - 1.0, 2.0 * depth - 1.0, 1.0); })";
constexpr const char* kFragmentSource = "#version 330 core\nvoid main() {}";

}  // namespace

struct StencilReference::State {
  OsmesaContext context;
  int side = 0;
  Name program = 0;
  int depth_location = -1;

  template <class... Arguments>
  auto call(const char* name, Arguments... arguments) const {
    return context.load<void (*)(Arguments...)>(name)(arguments...);
  }
  template <class Value, class... Arguments>
  Value ask(const char* name, Arguments... arguments) const {
    return context.load<Value (*)(Arguments...)>(name)(arguments...);
  }
  void attach(Enum kind, const char* source) const;
  void make_program();
  void make_framebuffer() const;
  void make_vertices() const;
  void fan(const std::vector<Vec2>& polygon) const;
  void add(const std::array<std::vector<Vec2>, kViews>& views, float depth) const;
};

void StencilReference::State::attach(Enum kind, const char* source) const {
  const Name shader = ask<Name>("glCreateShader", kind);
  call("glShaderSource", shader, 1, static_cast<const char* const*>(&source),
       static_cast<const int*>(nullptr));
  call("glCompileShader", shader);
  call("glAttachShader", program, shader);
}

void StencilReference::State::make_program() {
  program = ask<Name>("glCreateProgram");
  attach(kVertexShader, kVertexSource);
  attach(kFragmentShader, kFragmentSource);
  call("glLinkProgram", program);
  int linked = 0;
  call("glGetProgramiv", program, kLinkStatus, &linked);
  PVS_CHECK_EQ(linked, 1);
  call("glUseProgram", program);
  call("glUniform1f", ask<int>("glGetUniformLocation", program, "two_over_side"),
       2.0f / static_cast<float>(side));
  depth_location = ask<int>("glGetUniformLocation", program, "depth");
}

void StencilReference::State::make_framebuffer() const {
  Name framebuffer = 0, buffer = 0;
  call("glGenFramebuffers", 1, &framebuffer);
  call("glBindFramebuffer", kFramebuffer, framebuffer);
  call("glGenRenderbuffers", 1, &buffer);
  call("glBindRenderbuffer", kRenderbuffer, buffer);
  call("glRenderbufferStorage", kRenderbuffer, kDepth32fStencil8, side, side);
  call("glFramebufferRenderbuffer", kFramebuffer, kDepthStencilAttachment, kRenderbuffer, buffer);
  PVS_CHECK_EQ(ask<Enum>("glCheckFramebufferStatus", kFramebuffer), kFramebufferComplete);
  call("glViewport", 0, 0, side, side);
}

void StencilReference::State::make_vertices() const {
  Name array = 0, buffer = 0;
  call("glGenVertexArrays", 1, &array);
  call("glBindVertexArray", array);
  call("glGenBuffers", 1, &buffer);
  call("glBindBuffer", kArrayBuffer, buffer);
  call("glVertexAttribPointer", 0u, 2, kFloat, static_cast<unsigned char>(0), 0,
       static_cast<const void*>(nullptr));
  call("glEnableVertexAttribArray", 0u);
}

void StencilReference::State::fan(const std::vector<Vec2>& polygon) const {
  std::vector<float> floats;
  for (const Vec2& p : polygon) {
    floats.push_back(static_cast<float>(p.x));
    floats.push_back(static_cast<float>(p.y));
  }
  call("glBufferData", kArrayBuffer, static_cast<std::ptrdiff_t>(floats.size() * sizeof(float)),
       static_cast<const void*>(floats.data()), kStreamDraw);
  call("glDrawArrays", kTriangleFan, 0, static_cast<int>(polygon.size()));
}

// The numbered steps of theory A.7.
void StencilReference::State::add(const std::array<std::vector<Vec2>, kViews>& views,
                                  float depth) const {
  constexpr unsigned char kFalse = 0, kTrue = 1;
  call("glUniform1f", depth_location, depth);
  // 1. A clean stencil.
  call("glStencilMask", kAllBits);
  call("glClear", kStencilBufferBit);
  // 2. Every view sets its bit where it is nearer than what the map holds.
  call("glDepthMask", kFalse);
  call("glDepthFunc", kLess);
  call("glStencilFunc", kAlways, static_cast<int>(kAllBits), kAllBits);
  call("glStencilOp", kKeep, kKeep, kReplace);
  for (int k = 0; k < kViews; ++k) {
    call("glStencilMask", 1u << k);
    fan(views[k]);
  }
  // 3. Where all eight bits stand, the depth is written.
  call("glDepthMask", kTrue);
  call("glDepthFunc", kAlways);
  call("glStencilMask", 0u);
  call("glStencilFunc", kEqual, static_cast<int>(kAllBits), kAllBits);
  call("glStencilOp", kKeep, kKeep, kKeep);
  fan(views[0]);
}

StencilReference::StencilReference(int side_px) : state_(std::make_unique<State>()) {
  state_->side = side_px;
  state_->make_framebuffer();
  state_->make_program();
  state_->make_vertices();
  state_->call("glEnable", kDepthTest);
  state_->call("glEnable", kStencilTest);
}

StencilReference::~StencilReference() = default;

std::vector<float> StencilReference::draw(std::span<const Piece> pieces,
                                          const ProjectionPlane& plane) {
  State& s = *state_;
  PVS_CHECK_EQ(plane.resolution_px, s.side);
  s.context.make_current();
  // Depths go linearly to [1/4, 3/4]; 1 is nothing.
  double nearest = 0, farthest = 0;
  for (const Piece& piece : pieces) {
    nearest = std::min(nearest, piece.box.hi.z);
    farthest = std::max(farthest, piece.box.hi.z);
  }
  const double range = std::max(farthest - nearest, 1e-30);
  s.call("glDepthMask", static_cast<unsigned char>(1));
  s.call("glClearDepth", 1.0);
  s.call("glClear", kDepthBufferBit);
  for (const Piece& piece : pieces) {
    std::array<std::vector<Vec2>, kViews> views;
    bool all = true;
    for (int k = 0; k < kViews; ++k) {
      views[k] = shrunk_view(piece, plane, k);
      all &= !views[k].empty();
    }
    if (all) s.add(views, static_cast<float>(0.25 + (piece.box.hi.z - nearest) / range / 2));
  }
  std::vector<float> depths(static_cast<std::size_t>(s.side) * s.side);
  s.call("glReadPixels", 0, 0, s.side, s.side, kDepthComponent, kFloat,
         static_cast<void*>(depths.data()));
  PVS_CHECK_EQ(s.ask<Enum>("glGetError"), 0u);
  for (float& d : depths)
    d = d == 1.0f ? std::numeric_limits<float>::infinity()
                  : static_cast<float>(nearest + (d - 0.25) * 2 * range);
  return depths;
}

}  // namespace pvsfarm
