#include "server/admin/jobs.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/ascii.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"

namespace liquidblend::admin {

absl::StatusOr<QueueReport> InspectQueue(store::Catalog& catalog, int num_failed) {
  QueueReport report;
  LB_ASSIGN_OR_RETURN(report.counts, catalog.CountJobs());
  LB_ASSIGN_OR_RETURN(report.unfinished, catalog.ListUnfinishedJobs());
  std::string token;
  int num_seen = 0;
  while (report.failed.size() < static_cast<size_t>(num_failed) && num_seen < kHistory) {
    LB_ASSIGN_OR_RETURN(store::Page<store::pb::JobRecord> page, catalog.ListJobs(1000, token));
    num_seen += static_cast<int>(page.records.size());
    for (store::pb::JobRecord& job : page.records) {
      const bool is_wanted = job.state() == store::pb::JobRecord::FAILED &&
                             report.failed.size() < static_cast<size_t>(num_failed);
      if (is_wanted) report.failed.push_back(std::move(job));
    }
    token = std::move(page.next_page_token);
    if (token.empty()) break;
  }
  return report;
}

absl::StatusOr<std::vector<Worker>> InspectWorkers(store::Catalog& catalog) {
  LB_ASSIGN_OR_RETURN(const std::vector<store::HeldJob> jobs, catalog.ListUnfinishedJobs());
  LB_ASSIGN_OR_RETURN(const std::vector<store::pb::WorkerRecord> seen, catalog.ListWorkers());
  std::map<std::string, Worker> workers;
  for (const store::pb::WorkerRecord& record : seen) {
    workers[record.name()] = {.name = record.name(),
                              .last_seen = store::ToTime(record.seen_time()),
                              .memory_bytes = record.memory_bytes(),
                              .refusal = record.refusal(),
                              .work = {}};
  }
  for (const store::HeldJob& held : jobs) {
    if (held.job.state() != store::pb::JobRecord::RUNNING) continue;
    Worker& worker = workers[held.job.worker()];
    worker.name = held.job.worker();
    worker.last_seen = std::max(worker.last_seen, store::ToTime(held.job.update_time()));
    worker.work.push_back({.job = held.job.id(),
                           .subject = store::SubjectOf(held.job),
                           .stage = held.job.progress().stage(),
                           .fraction = held.job.progress().fraction(),
                           .since = store::ToTime(held.job.start_time()),
                           .last_heartbeat = store::ToTime(held.job.update_time()),
                           .lease_expires = held.lease_expires});
  }
  std::vector<Worker> list;
  for (auto& [name, worker] : workers) list.push_back(std::move(worker));
  return list;
}

std::string StateName(store::pb::JobRecord::State state) {
  return absl::AsciiStrToLower(store::pb::JobRecord::State_Name(state));
}

}  // namespace liquidblend::admin
