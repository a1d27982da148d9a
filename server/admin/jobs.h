// Reports on the job queue and its workers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::admin {

struct QueueReport {
  store::JobCounts counts;                   // jobs and children, by state
  std::vector<store::HeldJob> unfinished;    // in the order of submission
  std::vector<store::pb::JobRecord> failed;  // the newest first
};

// The report includes the last `num_failed` failed jobs among the last kHistory jobs. Errors: those
// of the catalog.
inline constexpr int kHistory = 10'000;
absl::StatusOr<QueueReport> InspectQueue(store::Catalog& catalog, int num_failed);

struct HeldWork {
  std::string job;      // "import-..", "register-..", or a child of such
  std::string subject;  // "animations/x" or "families/x"
  std::string stage;
  double fraction = 0;
  absl::Time since;
  absl::Time last_heartbeat;
  absl::Time lease_expires;
};

struct Worker {
  std::string name;                             // host:process
  absl::Time last_seen = absl::InfinitePast();  // by the catalog's clock
  int64_t memory_bytes = 0;                     // the largest job that it takes; 0: not known
  std::string refusal;                          // why it takes no jobs; empty: it takes them
  std::vector<HeldWork> work;                   // empty: idle
};

// The workers that hold leases or were recorded within store::kWorkerSilence, by name.
absl::StatusOr<std::vector<Worker>> InspectWorkers(store::Catalog& catalog);

// "QUEUED" -> "queued"
std::string StateName(store::pb::JobRecord::State state);

}  // namespace liquidblend::admin
