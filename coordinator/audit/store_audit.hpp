// Audits a finished store: which cells are asked about in which order and how hard, and what comes
// of it. Rays only falsify: an audit that finds nothing is no proof.
//
// Pass after pass goes over all leaf cells, in an order of its own that keeps a few neighbours
// together, with more rays each time, and over some of the inner ones. The first pass is cheap, so
// that it reaches every cell of a large store: what a cell lacks but its neighbours have is looked
// for first. Source: theory F (sampled sets are lower bounds); the suspects are spatial coherence
// turned against the store. Threads: one.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/pvs/inquiry.hpp"
#include "common/pvs/store_reader.hpp"
#include "coordinator/audit/sets_cache.hpp"
#include "coordinator/service/inquiry_work.hpp"

namespace pvsfarm {

struct FoundViolation {
  std::uint32_t cell = 0;  // node of the store
  ObjectId object{};
  SightLine line;
};

// How far the certified part of a leaf cell's PVS is from all of it.
struct CellGap {
  std::uint32_t cell = 0;
  std::uint64_t triangles = 0, seen_triangles = 0;  // of its PVS; of what is certainly seen of it
  double gap() const {
    return triangles == 0
               ? 0
               : 1 - static_cast<double>(seen_triangles) / static_cast<double>(triangles);
  }
};

struct AuditFigures {
  std::uint32_t leaves = 0, inner = 0;  // cells of the store
  std::uint32_t leaves_reached = 0, inner_reached = 0;
  std::uint64_t questions = 0, rays = 0, given_up = 0;
  int passes = 0;  // over all leaves, finished
};

class StoreAudit : public InquirySource {
 public:
  // `store` outlives the audit. Errors: kInvalidInput (damaged).
  static Result<std::unique_ptr<StoreAudit>> make(StoreReader& store, std::uint64_t seed);

  // From now on the cell's PVS is taken to lack the object.
  void plant(std::uint32_t cell, ObjectId object) { plants_[cell].push_back(object); }

  std::uint32_t count() const override;
  Result<Question> question(std::uint32_t number) override;
  bool together(std::uint32_t, std::uint32_t) const override { return true; }
  void answered(std::uint32_t number, Finding finding) override;
  void given_up(std::uint32_t) override { ++figures_.given_up; }

  AuditFigures figures() const;
  // One for each cell and object, by cell.
  std::vector<FoundViolation> violations() const;
  std::size_t violation_count() const { return violations_.size(); }
  // Of the leaf cells that were reached, the tightest first. Errors: kInvalidInput (damaged).
  Result<std::vector<CellGap>> gaps();
  // Objects of PVSs that the audit saw and the store does not certify. After gaps().
  std::uint64_t newly_seen() const { return newly_seen_; }

 private:
  struct Place {
    int pass = 0;
    std::uint32_t cell = 0;
  };
  StoreAudit(StoreReader& store, std::uint64_t seed);

  std::uint32_t inner_a_pass() const;
  Place place_of(std::uint32_t number) const;
  Result<StoredSets> sets(std::uint32_t cell);
  Result<std::vector<std::uint32_t>> cells_beside(const StoredNode& node);
  Result<VisibleSet> suspects(const StoredNode& node, const VisibleSet& visible, bool certified);
  std::uint64_t rays_for(int pass, std::uint64_t suspects) const;

  StoreReader& store_;
  SetsCache read_;
  std::uint64_t seed_;
  std::vector<std::uint32_t> leaves_, inner_;  // shuffled
  std::vector<StoreObject> objects_;
  std::map<std::uint32_t, std::vector<ObjectId>> plants_;
  std::vector<std::uint8_t> reached_;  // by cell
  std::map<std::pair<std::uint32_t, ObjectId>, SightLine> violations_;
  // What the audit saw of leaf cells, in canonical bytes: as words they might fill the memory.
  std::map<std::uint32_t, std::vector<std::byte>> seen_;
  std::vector<std::uint32_t> answered_a_pass_;
  AuditFigures figures_;
  std::uint64_t newly_seen_ = 0;
};

}  // namespace pvsfarm
