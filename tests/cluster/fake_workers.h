// Workers without work: they lease jobs of a real queue, keep their leases, sleep and publish.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::bench {

struct FakeWorkersOptions {
  std::string url;                             // of the catalog: postgresql://...
  int num_workers = 1000;                      // > 0
  int num_processes = 10;                      // > 0; the workers are threads of these
  absl::Duration start = absl::Seconds(30);    // until all have started, one after the other
  absl::Duration job = absl::Seconds(5);       // on average; from half to one and a half times that
  absl::Duration give_up = absl::Minutes(60);  // the most time until the queue is empty
  // Called every second while they work. Its errors are counted.
  std::function<absl::Status(store::Catalog&)> look = [](store::Catalog&) {
    return absl::OkStatus();
  };
};

// What the workers saw. Times are seconds of the monotonic clock, which processes share.
struct WorkReport {
  std::vector<double> leased_s;    // when each lease was given
  std::vector<double> lease_ms;    // how long that took
  std::vector<double> publish_ms;  // how long the end of each job took
  int64_t num_published = 0;       // ends that the catalog accepted
  int64_t num_later_attempts = 0;  // leases of jobs that had been leased before
  int64_t num_lost = 0;            // jobs whose lease was lost
  int64_t num_errors = 0;          // calls that failed otherwise
  int64_t num_failed_starts = 0;   // the catalog could not be opened; repeated after a pause
  int64_t num_failed_looks = 0;    // options.look, or the count of jobs, failed; repeated
};

// Runs the workers until no job is queued or running.
// Errors: the catalog's; kInternal if a process fails; kDeadlineExceeded after options.give_up.
absl::StatusOr<WorkReport> RunFakeWorkers(const FakeWorkersOptions& options);

}  // namespace liquidblend::bench
