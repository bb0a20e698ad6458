// Candidates for witnesses from rendered views: which triangle is the nearest in every direction
// from a viewpoint, drawn with OSMesa six pictures a viewpoint. What a pixel shows proves nothing;
// the sampler checks it (sampler.hpp). Which pixels show a triangle is Mesa's to say: bakes that
// use item buffers have equal bytes on machines with the same Mesa and the same kind of processor.
//
// Source: item buffers as in every sampled visible set (theory F).
#pragma once

#include <memory>
#include <vector>

#include "common/pvs/visible_set.hpp"
#include "common/scene/scene.hpp"
#include "worker/render/item_buffer.hpp"
#include "worker/visibility/sampler.hpp"

namespace pvsfarm {

class ItemViews {
 public:
  // What a look cost. [units] triangles drawn, over all views; pixels.
  struct Cost {
    std::uint64_t triangles = 0, pixels = 0;
  };

  // `side_px`: of a view.
  ItemViews(std::shared_ptr<const Scene> scene, int side_px);

  // Draws the objects of `drawn`, and all that only occludes, as seen from `eye`; what is nearer
  // than near_m, or a hundred-thousandth of the scene, is left out. Returns the middle of every
  // run of one triangle along a row of pixels, as far as it belongs to an object of `wanted`.
  // Valid until the next look.
  const std::vector<SightCandidate>& look(const Vec3& eye, double near_m, const VisibleSet& drawn,
                                          const VisibleSet& wanted);
  Cost cost() const { return cost_; }  // of the last look

 private:
  void gather(const Vec3& eye, const VisibleSet& drawn, bool passable);
  void add_object(ObjectId id, const Vec3& eye);
  void draw_views(double near, const VisibleSet& wanted);
  void read(const ItemView& view, std::span<const std::uint32_t> pixels, const VisibleSet& wanted);

  std::shared_ptr<const Scene> scene_;
  ItemBuffer buffer_;
  std::vector<std::uint32_t> object_of_;  // by triangle
  bool has_passable_ = false;
  std::vector<ItemVertex> triangles_[6];  // of each view
  std::vector<SightCandidate> items_;
  Cost cost_;
};

}  // namespace pvsfarm
