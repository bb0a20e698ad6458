#include "worker/visibility/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <array>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

// The triangles of one geometry, by Embree's number.
struct Shell {
  bool two_sided = true;
  std::vector<std::uint32_t> triangle;
};

// What a query carries to the filter functions.
struct QueryContext {
  RTCIntersectContext embree;
  std::vector<RayScene::Passed>* passed = nullptr;
  std::span<const std::uint8_t> skip;
  std::span<const std::uint32_t> object_of;
};

bool from_behind(const RTCFilterFunctionNArguments& args, unsigned i) {
  const unsigned n = args.N;
  return RTCHitN_Ng_x(args.hit, n, i) * RTCRayN_dir_x(args.ray, n, i) +
             RTCHitN_Ng_y(args.hit, n, i) * RTCRayN_dir_y(args.ray, n, i) +
             RTCHitN_Ng_z(args.hit, n, i) * RTCRayN_dir_z(args.ray, n, i) >
         0;
}

void reject_backs(const RTCFilterFunctionNArguments* args) {
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] != 0 && from_behind(*args, i)) args->valid[i] = 0;
}

// Notes the hit and lets the ray go on.
void note_and_pass(const RTCFilterFunctionNArguments* args) {
  const auto& shell = *static_cast<const Shell*>(args->geometryUserPtr);
  auto* context = reinterpret_cast<QueryContext*>(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    args->valid[i] = 0;
    const std::uint32_t triangle = shell.triangle[RTCHitN_primID(args->hit, args->N, i)];
    if (context->skip[context->object_of[triangle]] != 0) continue;
    if (!shell.two_sided && from_behind(*args, i)) continue;
    context->passed->push_back({RTCRayN_id(args->ray, args->N, i), triangle});
  }
}

}  // namespace

struct RayScene::State {
  Vec3 origin{0};
  double radius = 0;
  RTCDevice device = nullptr;
  RTCScene opaque = nullptr, passable = nullptr;
  std::array<Shell, 4> shells;           // opaque, passable; each one-sided, two-sided
  std::vector<float> vertices;           // three a vertex, relative to the origin
  std::vector<std::uint32_t> object_of;  // by triangle
  std::array<RTCRayHit, kBatch> rays;
  std::array<RTCRay, kBatch> short_rays;

  bool has_passable() const { return !shells[2].triangle.empty() || !shells[3].triangle.empty(); }
  bool too_thin(const Scene& scene, std::uint32_t triangle) const;
  void sort_triangles(const Scene& scene);
  void attach(const Scene& scene, Shell& shell, bool is_opaque);
};

// The point where a ray meets the plane of a triangle is off by about 2^-22 longest^2 / height in
// float, beside what float_error() holds; that is kept below an eighth of it.
bool RayScene::State::too_thin(const Scene& scene, std::uint32_t triangle) const {
  const SeenTriangle t(scene, triangle, origin);
  const double h = t.height();
  return !(h > float_error(radius)) || !(t.longest * t.longest < radius * h);
}

void RayScene::State::sort_triangles(const Scene& scene) {
  object_of.resize(scene.all_triangles().size());
  for (std::uint32_t o = 0; o < scene.object_count(); ++o) {
    const ObjectRecord& object = scene.object(ObjectId{o});
    const bool is_opaque = object.occluder && !object.dynamic;
    Shell& shell = shells[(is_opaque ? 0 : 2) + (object.two_sided ? 1 : 0)];
    for (std::uint32_t i = 0; i < object.triangle_count; ++i) {
      const auto t = static_cast<std::uint32_t>(object.first_triangle) + i;
      object_of[t] = o;
      if (!too_thin(scene, t)) shell.triangle.push_back(t);
    }
  }
  vertices.reserve(3 * scene.vertices().size() + 4);
  for (const Vec3& v : scene.vertices())
    for (int a = 0; a < 3; ++a) vertices.push_back(static_cast<float>(v[a] - origin[a]));
  vertices.resize(vertices.size() + 4);  // Embree reads 16 bytes at a time
}

void RayScene::State::attach(const Scene& scene, Shell& shell, bool is_opaque) {
  if (shell.triangle.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             vertices.data(), 0, 3 * sizeof(float), scene.vertices().size());
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), shell.triangle.size()));
  for (const std::uint32_t t : shell.triangle)
    for (const std::uint32_t v : scene.all_triangles()[t].vertex) *indices++ = v;
  if (!is_opaque) {
    rtcSetGeometryUserData(geometry, &shell);
    rtcSetGeometryOccludedFilterFunction(geometry, note_and_pass);
  } else if (!shell.two_sided) {
    rtcSetGeometryIntersectFilterFunction(geometry, reject_backs);
  }
  rtcCommitGeometry(geometry);
  const auto id = static_cast<unsigned>(&shell - shells.data());
  rtcAttachGeometryByID(is_opaque ? opaque : passable, geometry, id);
  rtcReleaseGeometry(geometry);
}

RayScene::RayScene(const Scene& scene, const Vec3& origin, const std::string& config)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.origin = origin;
  s.radius = scene.bounds().empty() ? 0 : 0.5 * length(scene.bounds().size());
  s.device = rtcNewDevice(("threads=1" + (config.empty() ? "" : "," + config)).c_str());
  PVS_CHECK(s.device != nullptr);
  s.sort_triangles(scene);
  for (int k = 0; k < 4; ++k) s.shells[k].two_sided = k & 1;
  for (RTCScene* embree : {&s.opaque, &s.passable}) {
    *embree = rtcNewScene(s.device);
    rtcSetSceneFlags(*embree, RTC_SCENE_FLAG_ROBUST);
  }
  for (int k = 0; k < 4; ++k) s.attach(scene, s.shells[k], k < 2);
  rtcCommitScene(s.opaque);
  rtcCommitScene(s.passable);
}

RayScene::~RayScene() {
  rtcReleaseScene(state_->opaque);
  rtcReleaseScene(state_->passable);
  rtcReleaseDevice(state_->device);
}

void RayScene::cast(std::span<const Sightline> lines, std::span<const std::uint8_t> skip,
                    std::span<Hit> hits, std::vector<Passed>& passed) {
  State& s = *state_;
  PVS_CHECK_LE(lines.size(), kBatch);
  const auto count = static_cast<unsigned>(lines.size());
  std::array<double, kBatch> lengths;
  for (unsigned i = 0; i < count; ++i) {
    const Vec3 from = lines[i].eye - s.origin, d = lines[i].point - lines[i].eye;
    lengths[i] = length(d);
    const Vec3 unit = lengths[i] > 0 ? d / lengths[i] : Vec3{1, 0, 0};
    s.rays[i].ray = {.org_x = static_cast<float>(from.x),
                     .org_y = static_cast<float>(from.y),
                     .org_z = static_cast<float>(from.z),
                     .tnear = 0,
                     .dir_x = static_cast<float>(unit.x),
                     .dir_y = static_cast<float>(unit.y),
                     .dir_z = static_cast<float>(unit.z),
                     .time = 0,
                     .tfar = static_cast<float>(4 * (s.radius + length(from))),
                     .mask = ~0u,
                     .id = i,
                     .flags = 0};
    s.rays[i].hit.geomID = RTC_INVALID_GEOMETRY_ID;
  }
  QueryContext context;
  rtcInitIntersectContext(&context.embree);
  context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  context.passed = &passed;
  context.skip = skip;
  context.object_of = s.object_of;
  rtcIntersect1M(s.opaque, &context.embree, s.rays.data(), count, sizeof(RTCRayHit));
  for (unsigned i = 0; i < count; ++i) {
    const RTCRayHit& r = s.rays[i];
    const bool met = r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    hits[i].triangle = met ? s.shells[r.hit.geomID].triangle[r.hit.primID] : kNoTriangle;
    hits[i].t = lengths[i] > 0 ? static_cast<double>(r.ray.tfar) / lengths[i] : 0;
  }
  passed.clear();
  if (!s.has_passable()) return;
  for (unsigned i = 0; i < count; ++i) s.short_rays[i] = s.rays[i].ray;
  rtcOccluded1M(s.passable, &context.embree, s.short_rays.data(), count, sizeof(RTCRay));
}

}  // namespace pvsfarm
