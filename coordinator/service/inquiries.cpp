#include "coordinator/service/inquiries.hpp"

namespace pvsfarm {

Result<InquirySummary> run_inquiries(const InquiryJob& job, InquirySource& source,
                                     const FarmOptions& options, const FarmObserver& observer) {
  const Result<PrivateFolder> folder = PrivateFolder::make();
  if (!folder) return folder.error();
  if (Status status = put_scene(*folder, job.scene->bundle()); !status) return status.error();
  InquiryWork work(source, job.scene->object_count());
  FarmFigures figures;
  const FarmJob farm{.scene = job.scene, .settings = job.settings, .deadline = job.deadline};
  const Status status = run_farm(farm, work, *folder, options, observer, figures);
  if (!status && status.error().kind != ErrorKind::kInterrupted) return status.error();
  return InquirySummary{work.answered(), work.given_up(), !status.ok(), figures.workers};
}

}  // namespace pvsfarm
