// Inquiries with a farm of their own: audits, explanations, measurements.
#pragma once

#include "coordinator/service/farm.hpp"
#include "coordinator/service/inquiry_work.hpp"

namespace pvsfarm {

struct InquiryJob {
  std::shared_ptr<const Scene> scene;
  EvaluatorSettings settings;  // of the evaluator, where a question has none of its own
  std::optional<std::chrono::steady_clock::time_point> deadline;
};

struct InquirySummary {
  std::uint64_t answered = 0, given_up = 0;
  bool interrupted = false;   // by Ctrl-C: what was answered counts
  std::uint64_t workers = 0;  // sessions in all
};

// Until every question is answered or given up, or the deadline.
// Requires: as run_farm(). Errors: kIo, kRuntime (no worker left), those of the source.
Result<InquirySummary> run_inquiries(const InquiryJob& job, InquirySource& source,
                                     const FarmOptions& options, const FarmObserver& observer);

}  // namespace pvsfarm
