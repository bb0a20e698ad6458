#include "worker/visibility/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <new>

#include "common/base/check.hpp"

namespace pvsfarm {
namespace {

void reject_backs(const RTCFilterFunctionNArguments* args) {
  const unsigned n = args->N;
  for (unsigned i = 0; i < n; ++i) {
    if (args->valid[i] == 0) continue;
    const float slope = RTCHitN_Ng_x(args->hit, n, i) * RTCRayN_dir_x(args->ray, n, i) +
                        RTCHitN_Ng_y(args->hit, n, i) * RTCRayN_dir_y(args->ray, n, i) +
                        RTCHitN_Ng_z(args->hit, n, i) * RTCRayN_dir_z(args->ray, n, i);
    if (slope > 0) args->valid[i] = 0;
  }
}

}  // namespace

struct RayScene::State {
  Vec3 origin{0};
  RTCDevice device = nullptr;
  RTCScene embree = nullptr;
  // The triangles of the two geometries, one-sided and two-sided, by Embree's number.
  std::array<std::vector<std::uint32_t>, 2> triangles;
  std::vector<float> vertices;  // three a vertex, relative to the origin
  std::array<RTCRayHit, kBatch> rays;

  bool broken = false;  // memory ran out while Embree built it

  ~State() {
    if (broken) return;  // to release it then ends the process (Embree 3.13): it is left behind
    if (embree != nullptr) rtcReleaseScene(embree);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  // Embree has no exceptions. A scene that lacks parts would see through them.
  void check_memory() {
    broken = device == nullptr || rtcGetDeviceError(device) != RTC_ERROR_NONE;
    if (broken) throw std::bad_alloc();
  }
  void sort_triangles(const Scene& scene);
  void attach(const Scene& scene, unsigned two_sided);
};

void RayScene::State::sort_triangles(const Scene& scene) {
  for (const ObjectRecord& object : scene.objects()) {
    if (!object.occluder || object.dynamic) continue;
    for (std::uint32_t i = 0; i < object.triangle_count; ++i)
      triangles[object.two_sided ? 1 : 0].push_back(
          static_cast<std::uint32_t>(object.first_triangle) + i);
  }
  vertices.reserve(3 * scene.vertices().size() + 4);
  for (const Vec3& v : scene.vertices())
    for (int a = 0; a < 3; ++a) vertices.push_back(static_cast<float>(v[a] - origin[a]));
  vertices.resize(vertices.size() + 4);  // Embree reads 16 bytes at a time
}

void RayScene::State::attach(const Scene& scene, unsigned two_sided) {
  const std::vector<std::uint32_t>& chosen = triangles[two_sided];
  if (chosen.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             vertices.data(), 0, 3 * sizeof(float), scene.vertices().size());
  check_memory();
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), chosen.size()));
  check_memory();
  for (const std::uint32_t t : chosen)
    for (const std::uint32_t v : scene.all_triangles()[t].vertex) *indices++ = v;
  if (two_sided == 0) rtcSetGeometryIntersectFilterFunction(geometry, reject_backs);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(embree, geometry, two_sided);
  rtcReleaseGeometry(geometry);
}

RayScene::RayScene(const Scene& scene, const Vec3& origin, const std::string& config)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.origin = origin;
  if (config == kWithoutEmbree) return;
  s.device = rtcNewDevice(("threads=1" + (config.empty() ? "" : "," + config)).c_str());
  s.check_memory();
  s.embree = rtcNewScene(s.device);
  rtcSetSceneFlags(s.embree, RTC_SCENE_FLAG_ROBUST);
  s.sort_triangles(scene);
  for (const unsigned two_sided : {0u, 1u}) s.attach(scene, two_sided);
  rtcCommitScene(s.embree);
  s.check_memory();
}

RayScene::~RayScene() = default;

bool RayScene::has_embree() const { return state_->device != nullptr; }

void RayScene::name_blockers(std::span<const Sightline> lines, std::span<std::uint32_t> triangles) {
  // A ray stops this part of its length before the point it is aimed at.
  constexpr double kShort = 1e-5;
  State& s = *state_;
  PVS_CHECK_LE(lines.size(), kBatch);
  if (s.device == nullptr) {
    std::fill_n(triangles.begin(), lines.size(), kNoTriangle);
    return;
  }
  const auto count = static_cast<unsigned>(lines.size());
  for (unsigned i = 0; i < count; ++i) {
    const Vec3 from = lines[i].eye - s.origin, d = lines[i].point - lines[i].eye;
    s.rays[i].ray = {.org_x = static_cast<float>(from.x),
                     .org_y = static_cast<float>(from.y),
                     .org_z = static_cast<float>(from.z),
                     .tnear = 0,
                     .dir_x = static_cast<float>(d.x),
                     .dir_y = static_cast<float>(d.y),
                     .dir_z = static_cast<float>(d.z),
                     .time = 0,
                     .tfar = static_cast<float>(1 - kShort),
                     .mask = ~0u,
                     .id = i,
                     .flags = 0};
    s.rays[i].hit.geomID = RTC_INVALID_GEOMETRY_ID;
  }
  // Of the ways to cast, the stream of single rays was fastest: packets and the flag for coherent
  // rays took up to 1.7 times as long.
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1M(s.embree, &context, s.rays.data(), count, sizeof(RTCRayHit));
  for (unsigned i = 0; i < count; ++i) {
    const RTCHit& hit = s.rays[i].hit;
    triangles[i] =
        hit.geomID == RTC_INVALID_GEOMETRY_ID ? kNoTriangle : s.triangles[hit.geomID][hit.primID];
  }
}

}  // namespace pvsfarm
