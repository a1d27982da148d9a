// lb_cluster: the queue and the catalog of a large cluster: real tables and calls, workers without
// work. Prints what each call took, and whether a job was done twice.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog.h"
#include "tests/bench/load_report.h"
#include "tests/bench/require.h"
#include "tests/cluster/fake_workers.h"
#include "tests/cluster/fill_catalog.h"

namespace liquidblend::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Flags {
  std::string store;
  int64_t blobs = 1'000'000;
  int jobs = 100'000;
  int workers = 1000;
  int processes = 10;
  double start_s = 30.0;
  double job_s = 5.0;
  int submitters = 8;
};

double MsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// The times of calls by name.
using Times = std::map<std::string, std::vector<double>>;

template <typename Call>
absl::Status Measure(Times& times, const std::string& name, const Call& call) {
  const Clock::time_point begin = Clock::now();
  absl::Status status = call();
  times[name].push_back(MsSince(begin));
  return status;
}

void PrintTimes(const std::string& when, Times& times) {
  std::printf("\n| %s | calls | p50 ms | p99 ms |\n| --- | --- | --- | --- |\n", when.c_str());
  for (auto& [name, ms] : times) {
    std::sort(ms.begin(), ms.end());
    std::printf("| %s | %zu | %.2f | %.2f |\n", name.c_str(), ms.size(), Percentile(ms, 0.5),
                Percentile(ms, 0.99));
  }
  std::fflush(stdout);
}

// Calls that servers make while the cluster works.
absl::Status Look(store::Catalog& catalog, int64_t num_blobs, Times& times) {
  const std::string family =
      absl::StrCat("filled_family_", 10 * (std::rand() % std::max<int64_t>(1, num_blobs / 10)) + 9);
  LB_RETURN_IF_ERROR(Measure(times, "GetFamily", [&] {
    return num_blobs < 10 ? absl::OkStatus() : catalog.GetFamily(family).status();
  }));
  LB_RETURN_IF_ERROR(Measure(times, "ListAnimations, 100 of them",
                             [&] { return catalog.ListAnimations(100, "").status(); }));
  LB_RETURN_IF_ERROR(Measure(times, "CountJobs", [&] { return catalog.CountJobs().status(); }));
  LB_RETURN_IF_ERROR(
      Measure(times, "CountJobsByMemory", [&] { return catalog.CountJobsByMemory().status(); }));
  return Measure(times, "ListWorkers", [&] { return catalog.ListWorkers().status(); });
}

// Changes that clients make while the cluster works: a job that no worker can hold is submitted and
// cancelled. After an error the next call tries both again, since the queue must be empty at last.
absl::Status ChangeBesides(store::Catalog& catalog, Times& times) {
  static int number = 0;
  store::pb::AnimationRecord animation;
  animation.set_id(absl::StrCat("besides_", number));
  store::pb::JobRecord job;
  job.set_request_id(animation.id());
  job.mutable_import_animation()->set_animation(animation.id());
  job.set_memory_bytes(std::numeric_limits<int64_t>::max());
  LB_RETURN_IF_ERROR(Measure(times, "SubmitImport", [&]() -> absl::Status {
    LB_ASSIGN_OR_RETURN(job, catalog.SubmitImport(animation, job));
    return absl::OkStatus();
  }));
  LB_RETURN_IF_ERROR(
      Measure(times, "RequestCancel", [&] { return catalog.RequestCancel(job.id()); }));
  ++number;
  return absl::OkStatus();
}

// Everything that servers and clients ask for in a second while the cluster works.
absl::Status AskBesides(store::Catalog& catalog, int64_t num_blobs, Times& times) {
  static int number = 0;
  LB_RETURN_IF_ERROR(Look(catalog, num_blobs, times));
  if (++number % 60 == 0) {
    LB_RETURN_IF_ERROR(Measure(times, "ListReferencedBlobs (collect)",
                               [&] { return catalog.ListReferencedBlobs().status(); }));
  }
  return ChangeBesides(catalog, times);
}

void MeasureCatalog(store::Catalog& catalog, int64_t num_blobs) {
  Times times;
  for (int k = 0; k < 200; ++k) Require(Look(catalog, num_blobs, times));
  Require(Measure(times, "ListReferencedBlobs (collect)",
                  [&] { return catalog.ListReferencedBlobs().status(); }));
  PrintTimes(absl::StrCat("catalog with ", num_blobs, " blobs, idle"), times);
}

void Submit(store::Catalog& catalog, int k) {
  store::pb::AnimationRecord animation;
  animation.set_id(absl::StrCat("job_", k));
  store::pb::JobRecord job;
  job.mutable_import_animation()->set_animation(animation.id());
  job.set_owner(absl::StrCat("team_", k % 20));
  job.set_memory_bytes((int64_t{1} << 30) << (k % 4));
  Require(catalog.SubmitImport(animation, job).status());
}

// Submits all jobs from several threads.
void SubmitAll(store::Catalog& catalog, const Flags& flags) {
  const Clock::time_point begin = Clock::now();
  std::atomic<int> next = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < flags.submitters; ++t) {
    threads.emplace_back([&] {
      for (int k = next++; k < flags.jobs; k = next++) Submit(catalog, k);
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::printf("\nsubmitted %d jobs: %.0f a second\n", flags.jobs,
              1e3 * flags.jobs / MsSince(begin));
  std::fflush(stdout);
}

// Leases a second between the first tenth and the last tenth, where all workers work.
double SteadyRate(std::vector<double> leased_s) {
  std::sort(leased_s.begin(), leased_s.end());
  const size_t first = leased_s.size() / 10;
  const size_t last = leased_s.size() - 1 - first;
  return static_cast<double>(last - first) / (leased_s[last] - leased_s[first]);
}

int RunQueue(const Flags& flags) {
  Times times;
  const WorkReport report = Require(RunFakeWorkers(
      {.url = flags.store,
       .num_workers = flags.workers,
       .num_processes = flags.processes,
       .start = absl::Seconds(flags.start_s),
       .job = absl::Seconds(flags.job_s),
       .look = [&](store::Catalog& catalog) { return AskBesides(catalog, flags.blobs, times); }}));
  times["LeaseJob"] = report.lease_ms;
  times["PublishAnimation"] = report.publish_ms;
  PrintTimes(absl::StrCat("while ", flags.workers, " workers work"), times);
  std::printf(
      "\n| leases/s | published | leased again | lost | failed calls | failed starts |"
      " failed looks |\n| --- | --- | --- | --- | --- | --- | --- |\n"
      "| %.0f | %lld | %lld | %lld | %lld | %lld | %lld |\n",
      SteadyRate(report.leased_s), static_cast<long long>(report.num_published),
      static_cast<long long>(report.num_later_attempts), static_cast<long long>(report.num_lost),
      static_cast<long long>(report.num_errors), static_cast<long long>(report.num_failed_starts),
      static_cast<long long>(report.num_failed_looks));
  return report.num_published == flags.jobs && report.num_later_attempts == 0 ? 0 : 1;
}

int RunAll(const Flags& flags) {
  {
    const std::unique_ptr<store::Catalog> catalog =
        Require(store::OpenPostgresCatalog(flags.store));
    Require(FillCatalog(flags.store, flags.blobs));
    MeasureCatalog(*catalog, flags.blobs);
    SubmitAll(*catalog, flags);
  }  // a catalog must not be open on both sides of a fork
  return RunQueue(flags);
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app(
      "Measures queue and catalog of a large cluster; exit status 1 if a job was done twice");
  liquidblend::bench::Flags flags;
  app.add_option("--store", flags.store, "postgresql://... with an empty catalog")->required();
  app.add_option("--blobs", flags.blobs, "That the catalog refers to")->capture_default_str();
  app.add_option("--jobs", flags.jobs)->capture_default_str();
  app.add_option("--workers", flags.workers)->capture_default_str();
  app.add_option("--processes", flags.processes, "Of workers")->capture_default_str();
  app.add_option("--start-seconds", flags.start_s, "Until all workers have started")
      ->capture_default_str();
  app.add_option("--job-seconds", flags.job_s, "How long a job takes on average")
      ->capture_default_str();
  app.add_option("--submitters", flags.submitters, "Threads")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return liquidblend::bench::RunAll(flags);
}
