// What an audit found, for people and as JSON.
#pragma once

#include <string>
#include <vector>

#include "common/pvs/store_reader.hpp"
#include "coordinator/audit/plants.hpp"
#include "coordinator/audit/store_audit.hpp"

namespace pvsfarm {

struct AuditReport {
  std::string store;
  AuditFigures figures;
  std::vector<FoundViolation> violations;
  std::vector<CellGap> gaps;  // the tightest first
  std::uint64_t newly_seen = 0;
  std::vector<Plant> plants;
  double seconds = 0;
  bool interrupted = false;

  bool found(const Plant& plant) const;
  std::size_t plants_found() const;
};

// Errors of both: kInvalidInput (damaged store).
Result<std::string> audit_text(const AuditReport& report, StoreReader& store);
Result<std::string> audit_json(const AuditReport& report, StoreReader& store);

}  // namespace pvsfarm
