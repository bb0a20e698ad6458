#include "tests/support/seen_by_rays.hpp"

#include <embree3/rtcore.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/check.hpp"
#include "tests/support/aimed_rays.hpp"

namespace pvsfarm {
namespace {

constexpr int kPacket = 16;
constexpr int kMostPasses = 8;    // objects that let a ray pass, on one ray
constexpr int kAimedRounds = 32;  // between them, what was seen is no longer aimed at

struct Ray {
  Vec3 from, direction;
};

Vec3 random_direction(Random& random) {
  const double z = random.between(-1, 1), turn = random.between(0, 2 * std::numbers::pi);
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(turn), r * std::sin(turn), z};
}

Vec3 anywhere_in(const Cell& cell, Random& random) {
  Vec3 t;
  for (int a = 0; a < 3; ++a) t[a] = random.between(cell.lo[a], cell.hi[a]);
  return cell.point(t);
}

}  // namespace

struct RayCaster::State {
  std::shared_ptr<const Scene> scene;
  RTCDevice device = nullptr;
  RTCScene rays = nullptr;
  std::vector<std::uint32_t> object_of;  // by triangle of the scene

  void cast(const std::array<Ray, kPacket>& packet, std::vector<std::uint64_t>& seen,
            SeenByRays& result) const;
  Vec3 surface_point(ObjectId id, Random& random) const;
};

RayCaster::RayCaster(std::shared_ptr<const Scene> scene) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.scene = std::move(scene);
  s.device = rtcNewDevice("threads=1");
  PVS_CHECK(s.device != nullptr);
  RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               s.scene->vertices().size()));
  for (const Vec3& p : s.scene->vertices())
    for (int a = 0; a < 3; ++a) *vertices++ = static_cast<float>(p[a]);
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), s.scene->all_triangles().size()));
  for (const Triangle& t : s.scene->all_triangles())
    for (const std::uint32_t v : t.vertex) *indices++ = v;
  rtcCommitGeometry(geometry);
  s.rays = rtcNewScene(s.device);
  rtcSetSceneFlags(s.rays, RTC_SCENE_FLAG_ROBUST);
  rtcAttachGeometry(s.rays, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(s.rays);

  s.object_of.resize(s.scene->all_triangles().size());
  for (std::uint32_t i = 0; i < s.scene->object_count(); ++i) {
    const ObjectRecord& object = s.scene->object(ObjectId{i});
    for (std::uint32_t t = 0; t < object.triangle_count; ++t)
      s.object_of[object.first_triangle + t] = i;
  }
}

RayCaster::~RayCaster() {
  rtcReleaseScene(state_->rays);
  rtcReleaseDevice(state_->device);
}

void RayCaster::State::cast(const std::array<Ray, kPacket>& packet,
                            std::vector<std::uint64_t>& seen, SeenByRays& result) const {
  alignas(64) RTCRayHit16 lanes;
  alignas(64) int active[kPacket];
  for (int k = 0; k < kPacket; ++k) {
    active[k] = -1;
    lanes.ray.org_x[k] = static_cast<float>(packet[k].from.x);
    lanes.ray.org_y[k] = static_cast<float>(packet[k].from.y);
    lanes.ray.org_z[k] = static_cast<float>(packet[k].from.z);
    lanes.ray.dir_x[k] = static_cast<float>(packet[k].direction.x);
    lanes.ray.dir_y[k] = static_cast<float>(packet[k].direction.y);
    lanes.ray.dir_z[k] = static_cast<float>(packet[k].direction.z);
    lanes.ray.tnear[k] = 0;
    lanes.ray.time[k] = 0;
    lanes.ray.mask[k] = ~0u;
    lanes.ray.flags[k] = 0;
  }
  bool any = true;
  for (int pass = 0; any && pass < kMostPasses; ++pass) {
    for (int k = 0; k < kPacket; ++k) {
      lanes.ray.tfar[k] = std::numeric_limits<float>::infinity();
      lanes.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      lanes.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect16(active, rays, &context, &lanes);
    any = false;
    for (int k = 0; k < kPacket; ++k) {
      if (active[k] == 0) continue;
      active[k] = 0;
      if (lanes.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
      const std::uint32_t i = object_of[lanes.hit.primID[k]];
      const ObjectRecord& object = scene->object(ObjectId{i});
      // Embree's normal is (v1 - v0) x (v2 - v0): it looks out of a counter-clockwise front.
      const double facing = lanes.hit.Ng_x[k] * packet[k].direction.x +
                            lanes.hit.Ng_y[k] * packet[k].direction.y +
                            lanes.hit.Ng_z[k] * packet[k].direction.z;
      const bool shown = object.two_sided || facing < 0;
      if (shown && object.occludee && !(seen[i >> 6] >> (i & 63) & 1)) {
        seen[i >> 6] |= std::uint64_t{1} << (i & 63);
        result.witness[i] = {packet[k].from,
                             packet[k].from + packet[k].direction * double{lanes.ray.tfar[k]}};
      }
      if (object.occluder && !object.dynamic) continue;
      active[k] = -1;  // it does not block: on from just behind it
      lanes.ray.tnear[k] =
          std::nextafter(lanes.ray.tfar[k] * (1 + 1e-6f), std::numeric_limits<float>::infinity());
      any = true;
    }
  }
}

Vec3 RayCaster::State::surface_point(ObjectId id, Random& random) const {
  const auto triangles = scene->triangles(id);
  const Triangle& t = triangles[random.below(triangles.size())];
  double a = random.unit(), b = random.unit();
  if (a + b > 1) a = 1 - a, b = 1 - b;
  const auto vertices = scene->vertices();
  const Vec3 &p = vertices[t.vertex[0]], &q = vertices[t.vertex[1]], &r = vertices[t.vertex[2]];
  return p + (q - p) * a + (r - p) * b;
}

SeenByRays RayCaster::look(const Cell& cell, const VisibleSet& sought, std::uint64_t rays,
                           Random& random) const {
  const State& s = *state_;
  SeenByRays result;
  result.witness.resize(s.scene->object_count());
  std::vector<std::uint64_t> seen(sought.words().size());
  std::array<Ray, kPacket> packet;

  for (; result.rays < rays / 2; result.rays += kPacket) {
    for (Ray& ray : packet) ray = {anywhere_in(cell, random), random_direction(random)};
    s.cast(packet, seen, result);
  }
  for (int round = 0; round < kAimedRounds; ++round) {
    std::vector<ObjectId> open;
    sought.for_each([&](ObjectId id) {
      const std::uint32_t i = index_of(id);
      if (!(seen[i >> 6] >> (i & 63) & 1) && s.scene->object(id).triangle_count > 0)
        open.push_back(id);
    });
    if (open.empty()) break;
    const std::uint64_t end = rays / 2 + rays / 2 * (round + 1) / kAimedRounds;
    for (std::size_t next = 0; result.rays < end; result.rays += kPacket) {
      for (Ray& ray : packet) {
        const Vec3 from = sample_cell(cell, random);
        ray = {from, s.surface_point(open[next], random) - from};
        next = (next + 1) % open.size();
      }
      s.cast(packet, seen, result);
    }
  }
  result.seen = VisibleSet::from_words(sought.universe(), std::move(seen));
  return result;
}

}  // namespace pvsfarm
