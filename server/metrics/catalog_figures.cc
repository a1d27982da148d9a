#include "server/metrics/catalog_figures.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::metrics {
namespace {

using Job = store::pb::JobRecord;

constexpr int64_t kLargestMemoryGib = 1024;

std::string NameOf(Job::State state) { return absl::AsciiStrToLower(Job::State_Name(state)); }

// Adds up the jobs of a state that fit into each size of memory.
std::map<std::string, int64_t> SumWithinMemory(const store::JobMemoryCounts& counts,
                                               Job::State state) {
  std::map<std::string, int64_t> within = {{"any", 0}};
  for (int64_t gib = 1; gib <= kLargestMemoryGib; gib *= 2) within[absl::StrCat(gib, "GiB")] = 0;
  for (const auto& [key, count] : counts) {
    if (key.first != state) continue;
    within["any"] += count;
    for (int64_t gib = 1; gib <= kLargestMemoryGib; gib *= 2) {
      if (key.second <= gib) within[absl::StrCat(gib, "GiB")] += count;
    }
  }
  return within;
}

// Of the workers that were seen lately, refused ones too. Without any, no job is too large.
int64_t LargestMemory(const std::vector<store::pb::WorkerRecord>& workers) {
  int64_t largest = workers.empty() ? store::kAnyMemory : 0;
  for (const store::pb::WorkerRecord& worker : workers) {
    largest = std::max<int64_t>(largest, worker.memory_bytes());
  }
  return largest;
}

}  // namespace

absl::StatusOr<CatalogFigures> ReadCatalogFigures(store::Catalog& catalog) {
  LB_ASSIGN_OR_RETURN(const store::JobCounts jobs, catalog.CountJobs());
  LB_ASSIGN_OR_RETURN(const store::JobMemoryCounts memory, catalog.CountJobsByMemory());
  LB_ASSIGN_OR_RETURN(const std::vector<store::pb::WorkerRecord> workers, catalog.ListWorkers());
  // States without jobs or workers are shown as zero.
  CatalogFigures figures = {.jobs = {{"queued", 0}, {"running", 0}},
                            .workers = {{"ready", 0}, {"refused", 0}},
                            .jobs_within_memory = {},
                            .queue = {}};
  for (const auto& [state, count] : jobs) figures.jobs[NameOf(state)] = count;
  for (const Job::State state : {Job::QUEUED, Job::RUNNING}) {
    figures.jobs_within_memory[NameOf(state)] = SumWithinMemory(memory, state);
  }
  for (const store::pb::WorkerRecord& worker : workers) {
    ++figures.workers[worker.refusal().empty() ? "ready" : "refused"];
  }
  LB_ASSIGN_OR_RETURN(figures.queue, catalog.MeasureQueue(LargestMemory(workers)));
  return figures;
}

}  // namespace liquidblend::metrics
