#include "tests/support/embree_witness.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.hpp"
#include "tests/support/aimed_rays.hpp"
#include "tests/support/make_objects.hpp"

namespace pvsfarm {
namespace {

constexpr unsigned kBatch = 256;

// A hit of ray `ray` of the batch with a triangle, as Embree tells it.
struct BatchHit {
  unsigned ray = 0, object = 0, triangle = 0;
  float u = 0, v = 0;
};

// What a query carries to the filter functions.
struct QueryContext {
  RTCIntersectContext embree;
  std::vector<BatchHit>* passed = nullptr;  // hits of matter that rays pass through
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

// Notes the hit and lets the ray go on. The user data says whether backs can be seen.
void note_and_pass(const RTCFilterFunctionNArguments* args) {
  const bool two_sided = args->geometryUserPtr != nullptr;
  auto* context = reinterpret_cast<QueryContext*>(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    args->valid[i] = 0;
    if (!two_sided && from_behind(*args, i)) continue;
    context->passed->push_back(
        {RTCRayN_id(args->ray, args->N, i), RTCHitN_geomID(args->hit, args->N, i),
         RTCHitN_primID(args->hit, args->N, i), RTCHitN_u(args->hit, args->N, i),
         RTCHitN_v(args->hit, args->N, i)});
  }
}

Vec3 direction(Random& random) {
  const double z = random.between(-1, 1), angle = random.between(0, 6.283185307179586);
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace

struct EmbreeWitness::State {
  State(const SceneSource& s, const RayOracle& o) : source(s), oracle(o) {}

  const SceneSource& source;
  const RayOracle& oracle;
  std::vector<Box> boxes;  // by object
  Vec3 origin{0};          // subtracted in double before anything is a float
  double reach = 0;        // diagonal of the scene
  RTCDevice device = nullptr;
  RTCScene opaque = nullptr, passable = nullptr;
  bool has_passable = false;

  std::vector<Segment> aims;            // of the batch; `to` fixes only the direction
  std::vector<std::uint32_t> aimed_at;  // of the batch
  std::array<RTCRayHit, kBatch> rays;
  std::vector<BatchHit> passed;

  void add_object(std::uint32_t index);
  void cast();
  Vec3 hit_point(unsigned object, unsigned triangle, double u, double v) const;
  void credit(const BatchHit& hit, double margin, WitnessReport& report) const;
  void credit_batch(double margin, WitnessReport& report) const;
  void uniform(const Cell& cell, std::uint64_t count, double margin, Random& random,
               WitnessReport& report);
  void aimed(const Cell& cell, const WitnessRequest& request, double margin, Random& random,
             WitnessReport& report);
};

// One geometry an object, so that a geometry id is an object.
void EmbreeWitness::State::add_object(std::uint32_t index) {
  const SourceObject& object = source.objects[index];
  if (object.triangles.empty()) return;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               object.vertices.size()));
  for (const Vec3& v : object.vertices)
    for (int a = 0; a < 3; ++a) *vertices++ = static_cast<float>(v[a] - origin[a]);
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), object.triangles.size()));
  for (const auto& t : object.triangles)
    for (std::uint32_t i : t) *indices++ = i;
  const bool is_opaque = object.occluder && !object.dynamic;
  if (!is_opaque) {
    static const int kTwoSided = 1;
    rtcSetGeometryUserData(geometry, object.two_sided ? const_cast<int*>(&kTwoSided) : nullptr);
    rtcSetGeometryOccludedFilterFunction(geometry, note_and_pass);
    has_passable = true;
  } else if (!object.two_sided) {
    rtcSetGeometryIntersectFilterFunction(geometry, reject_backs);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(is_opaque ? opaque : passable, geometry, index);
  rtcReleaseGeometry(geometry);
}

EmbreeWitness::EmbreeWitness(const SceneSource& source, const RayOracle& oracle)
    : state_(std::make_unique<State>(source, oracle)) {
  State& s = *state_;
  Box bounds;
  for (const SourceObject& object : source.objects) {
    s.boxes.push_back(box_of(object));
    bounds.add(s.boxes.back());
  }
  s.origin = bounds.center();
  s.reach = length(bounds.size());
  s.device = rtcNewDevice("threads=1");
  PVS_CHECK(s.device != nullptr);
  for (RTCScene* scene : {&s.opaque, &s.passable}) {
    *scene = rtcNewScene(s.device);
    rtcSetSceneFlags(*scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST |
                                                        RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  }
  for (std::uint32_t o = 0; o < source.objects.size(); ++o) s.add_object(o);
  rtcCommitScene(s.opaque);
  rtcCommitScene(s.passable);
}

EmbreeWitness::~EmbreeWitness() {
  rtcReleaseScene(state_->opaque);
  rtcReleaseScene(state_->passable);
  rtcReleaseDevice(state_->device);
}

// Finds the first opaque hit of every ray of the batch, then what it passes before that.
void EmbreeWitness::State::cast() {
  passed.clear();
  for (unsigned i = 0; i < aims.size(); ++i) {
    const Vec3 from = aims[i].from - origin, d = aims[i].to - aims[i].from;
    const double n = length(d);
    const Vec3 unit = n > 0 ? d / n : Vec3{1, 0, 0};
    RTCRayHit& r = rays[i];
    r.ray = {.org_x = static_cast<float>(from.x),
             .org_y = static_cast<float>(from.y),
             .org_z = static_cast<float>(from.z),
             .tnear = 0,
             .dir_x = static_cast<float>(unit.x),
             .dir_y = static_cast<float>(unit.y),
             .dir_z = static_cast<float>(unit.z),
             .time = 0,
             .tfar = static_cast<float>(10 * (reach + length(from))),
             .mask = ~0u,
             .id = i,
             .flags = 0};
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  }
  QueryContext context;
  rtcInitIntersectContext(&context.embree);
  context.passed = &passed;
  const auto count = static_cast<unsigned>(aims.size());
  rtcIntersect1M(opaque, &context.embree, rays.data(), count, sizeof(RTCRayHit));
  if (!has_passable) return;
  std::array<RTCRay, kBatch> short_rays;
  for (unsigned i = 0; i < count; ++i) short_rays[i] = rays[i].ray;
  rtcOccluded1M(passable, &context.embree, short_rays.data(), count, sizeof(RTCRay));
}

Vec3 EmbreeWitness::State::hit_point(unsigned object, unsigned triangle, double u, double v) const {
  const SourceObject& o = source.objects[object];
  const auto& index = o.triangles[triangle];
  const Vec3 a = o.vertices[index[0]];
  return a + (o.vertices[index[1]] - a) * u + (o.vertices[index[2]] - a) * v;
}

void EmbreeWitness::State::credit(const BatchHit& hit, double margin, WitnessReport& report) const {
  if (report.seen(hit.object)) return;
  const Segment segment{aims[hit.ray].from, hit_point(hit.object, hit.triangle, hit.u, hit.v)};
  if (oracle.clear_by(segment, margin, hit.object)) report.witness[hit.object] = segment;
}

void EmbreeWitness::State::credit_batch(double margin, WitnessReport& report) const {
  report.rays += aims.size();
  for (unsigned i = 0; i < aims.size(); ++i) {
    const RTCHit& hit = rays[i].hit;
    if (hit.geomID != RTC_INVALID_GEOMETRY_ID)
      credit({i, hit.geomID, hit.primID, hit.u, hit.v}, margin, report);
  }
  for (const BatchHit& hit : passed) credit(hit, margin, report);
}

void EmbreeWitness::State::uniform(const Cell& cell, std::uint64_t count, double margin,
                                   Random& random, WitnessReport& report) {
  for (std::uint64_t done = 0; done < count; done += aims.size()) {
    aims.clear();
    while (aims.size() < std::min<std::uint64_t>(kBatch, count - done)) {
      const Vec3 from = sample_cell(cell, random);
      const SourceObject& object = source.objects[random.below(source.objects.size())];
      const bool at_object = random.next() & 1 && !object.triangles.empty();
      aims.push_back({from, at_object ? sample_surface(object, random) : from + direction(random)});
    }
    cast();
    credit_batch(margin, report);
  }
}

// Each target in turn; where a ray was blocked, the next two go past an edge of the blocker.
void EmbreeWitness::State::aimed(const Cell& cell, const WitnessRequest& request, double margin,
                                 Random& random, WitnessReport& report) {
  constexpr int kEscapes = 2;
  std::vector<std::uint32_t> open;
  const auto keep_open = [&](std::span<const std::uint32_t> from) {
    std::vector<std::uint32_t> left;
    for (std::uint32_t o : from)
      if (!report.seen(o) && !source.objects[o].triangles.empty()) left.push_back(o);
    open = std::move(left);
  };
  keep_open(request.targets);
  std::size_t turn = 0;
  int generation = 0;
  const std::uint64_t end = report.rays + request.aimed_rays;
  while (report.rays < end && !open.empty()) {
    if (generation == 0) {
      aims.clear();
      aimed_at.clear();
      while (aims.size() < std::min<std::uint64_t>(kBatch, end - report.rays)) {
        const std::uint32_t object = open[turn++ % open.size()];
        aimed_at.push_back(object);
        aims.push_back({sample_cell(cell, random), sample_surface(source.objects[object], random)});
      }
    } else {
      // The batch before this one is in `rays`: keep those that found a way past their blocker.
      std::size_t kept = 0;
      for (unsigned i = 0; i < aims.size(); ++i) {
        const RTCHit& hit = rays[i].hit;
        if (hit.geomID == RTC_INVALID_GEOMETRY_ID || report.seen(aimed_at[i])) continue;
        const BlockedAim aim{cell, boxes[aimed_at[i]], aims[i], source.objects[hit.geomID],
                             hit.primID};
        Segment past;
        if (!escape(aim, random, past)) continue;
        aims[kept] = past;
        aimed_at[kept++] = aimed_at[i];
      }
      aims.resize(std::min<std::uint64_t>(kept, end - report.rays));
      aimed_at.resize(aims.size());
    }
    generation = aims.empty() || generation == kEscapes ? 0 : generation + 1;
    if (aims.empty()) continue;
    cast();
    credit_batch(margin, report);
    if (generation == 0) keep_open(std::vector(open));
  }
}

std::size_t WitnessReport::seen_count() const {
  return static_cast<std::size_t>(
      std::count_if(witness.begin(), witness.end(), [](const auto& w) { return w.has_value(); }));
}

WitnessReport EmbreeWitness::sample(const Cell& cell, const WitnessRequest& request,
                                    Random& random) {
  WitnessReport report;
  report.witness.resize(state_->source.objects.size());
  const double margin = state_->oracle.margin_for(cell.bounds());
  state_->uniform(cell, request.uniform_rays, margin, random, report);
  state_->aimed(cell, request, margin, random, report);
  return report;
}

}  // namespace pvsfarm
