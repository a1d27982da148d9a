// lb_queue: what the job queue costs, and whether it is fair. Small jobs, in which nothing is done
// for some milliseconds, are taken and finished by worker processes of its own.
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/data_directory.h"
#include "tests/bench/require.h"

namespace liquidblend::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Flags {
  int jobs = 1000;
  int job_ms = 10;
  std::vector<int> workers = {2, 4, 8};
  std::string store = "/tmp/lb_queue";
};

std::unique_ptr<store::Catalog> Open(const std::string& where) {
  if (absl::StartsWith(where, "postgresql:")) return Require(store::OpenPostgresCatalog(where));
  std::filesystem::create_directories(where);
  return Require(store::OpenSqliteCatalog(store::CatalogPath(where)));
}

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// The first owner submits seven of ten jobs before the three others come with one of ten each.
std::string OwnerOf(int k, int num_jobs) {
  const int of_ten = 10 * k / num_jobs;
  return of_ten < 7 ? "large" : absl::StrCat("small_", of_ten - 7);
}

void Submit(store::Catalog& catalog, const std::string& round, int num_jobs) {
  for (int k = 0; k < num_jobs; ++k) {
    store::pb::AnimationRecord animation;
    animation.set_id(absl::StrCat(round, "_", k));
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(animation.id());
    job.set_owner(OwnerOf(k, num_jobs));
    Require(catalog.SubmitImport(animation, job).status());
  }
}

// Takes and finishes jobs until there are none.
void Work(const Flags& flags, int number) {
  const std::unique_ptr<store::Catalog> catalog = Open(flags.store);
  while (true) {
    auto lease = Require(catalog->LeaseJob(absl::StrCat("worker_", number), absl::Seconds(30)));
    if (!lease.has_value()) return;
    store::pb::AnimationRecord animation;
    animation.set_id(lease->job.import_animation().animation());
    animation.mutable_manifest()->set_num_frames(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(flags.job_ms));
    Require(catalog->PublishAnimation(lease->lease_id, animation));
  }
}

// Returns when all have ended.
void RunWorkers(const Flags& flags, int num_workers) {
  std::vector<pid_t> children;
  for (int w = 0; w < num_workers; ++w) {
    const pid_t child = fork();
    if (child == 0) {
      Work(flags, w);
      _exit(0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    if (waitpid(child, &status, 0) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
      std::fprintf(stderr, "lb_queue: a worker failed\n");
      std::exit(1);
    }
  }
}

struct Ended {
  int64_t at_us;
  std::string owner;
  std::string worker;
};

std::vector<Ended> JobsOf(store::Catalog& catalog, const std::string& round) {
  std::vector<Ended> ended;
  std::string token;
  do {
    const auto page = Require(catalog.ListJobs(1000, token));
    for (const store::pb::JobRecord& job : page.records) {
      if (!absl::StartsWith(job.import_animation().animation(), round + "_")) continue;
      if (job.state() != store::pb::JobRecord::SUCCEEDED) {
        Require(absl::InternalError(absl::StrCat("job ", job.id(), " is not done")));
      }
      const auto& time = job.update_time();
      ended.push_back(
          {time.seconds() * 1'000'000 + time.nanos() / 1000, job.owner(), job.worker()});
    }
    token = page.next_page_token;
  } while (!token.empty());
  std::sort(ended.begin(), ended.end(),
            [](const Ended& a, const Ended& b) { return a.at_us < b.at_us; });
  return ended;
}

// When the small owners' last job was done, as a share of all jobs.
double ShareUntilSmallOnesAreDone(const std::vector<Ended>& ended) {
  size_t last = 0;
  for (size_t k = 0; k < ended.size(); ++k) {
    if (ended[k].owner != "large") last = k + 1;
  }
  return static_cast<double>(last) / static_cast<double>(ended.size());
}

// The least busy worker's jobs for each of the busiest one's.
double WorkersBalance(const std::vector<Ended>& ended, int num_workers) {
  std::vector<int> counts(num_workers, 0);
  for (const Ended& job : ended) ++counts[std::atoi(job.worker.substr(7).c_str())];
  const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
  return static_cast<double>(*least) / *most;
}

void RunRound(const Flags& flags, int num_workers) {
  const std::string round = absl::StrCat("r", absl::ToUnixMicros(absl::Now()));
  double submit_s = 0.0;
  {
    const std::unique_ptr<store::Catalog> catalog = Open(flags.store);
    const Clock::time_point begin = Clock::now();
    Submit(*catalog, round, flags.jobs);
    submit_s = SecondsSince(begin);
  }  // a catalog must not be open on both sides of a fork
  const Clock::time_point begin = Clock::now();
  RunWorkers(flags, num_workers);
  const double work_s = SecondsSince(begin);
  const std::vector<Ended> ended = JobsOf(*Open(flags.store), round);
  std::printf("| %d | %.2f | %.0f | %.2f | %.2f | %.2f |\n", num_workers,
              1e3 * submit_s / flags.jobs, flags.jobs / work_s,
              1e3 * num_workers * work_s / flags.jobs - flags.job_ms,
              ShareUntilSmallOnesAreDone(ended), WorkersBalance(ended, num_workers));
  std::fflush(stdout);
}

}  // namespace
}  // namespace liquidblend::bench

int main(int argc, char** argv) {
  CLI::App app("Measures the job queue with small jobs");
  liquidblend::bench::Flags flags;
  app.add_option("--jobs", flags.jobs, "Of a round")->capture_default_str();
  app.add_option("--job-ms", flags.job_ms, "How long a job takes")->capture_default_str();
  app.add_option("--workers", flags.workers, "Processes, a round each")->delimiter(',');
  app.add_option("--store", flags.store, "A directory, or postgresql://... with an empty queue")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::printf(
      "| workers | submit ms/job | jobs/s | overhead ms/job | small owners done after | least busy "
      "worker |\n| --- | --- | --- | --- | --- | --- |\n");
  for (const int num_workers : flags.workers) liquidblend::bench::RunRound(flags, num_workers);
  return 0;
}
