// liquidblend-worker: takes jobs from the queue of a data directory and does them.
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/log.h"
#include "core/base/memory.h"
#include "core/base/status_macros.h"
#include "core/parallel/arena.h"
#include "core/store/blob_store.h"
#include "core/store/catalog.h"
#include "core/store/data_directory.h"
#include "worker/jobs/run_jobs.h"
#include "worker/jobs/stop_signal.h"

namespace liquidblend::worker {
namespace {

// A stage that does not listen is given so long to end after SIGTERM. Its job is back in the queue
// by then (LeaseKeeper), so nothing is lost when the process just ends.
constexpr absl::Duration kStopPatience = absl::Seconds(3);

struct Flags {
  std::string data;
  int threads = 0;  // 0: one per core
  std::string lease = "30s";
  std::string poll = "500ms";
  bool once = false;
  int parent = 0;  // 0: none
  bool verbose = false;
};

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("--data", flags.data, "Directory of the server whose jobs to do")->required();
  app.add_option("--threads", flags.threads, "Threads; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--lease", flags.lease, "How long a job waits for this worker if it says nothing")
      ->capture_default_str();
  app.add_option("--poll", flags.poll, "How often to look at an empty queue")
      ->capture_default_str();
  app.add_flag("--once", flags.once, "Exit as soon as the queue is empty");
  app.add_option("--parent", flags.parent, "Process to end with");
  app.add_flag("--verbose", flags.verbose, "Log details");
}

std::string WorkerName() {
  std::array<char, 256> host = {};
  if (gethostname(host.data(), host.size() - 1) != 0) host = {'?'};
  return absl::StrCat(host.data(), ":", getpid());
}

absl::StatusOr<jobs::JobLoopOptions> LoopOptionsOf(const Flags& flags) {
  jobs::JobLoopOptions options;
  options.worker = WorkerName();
  options.exit_when_idle = flags.once;
  if (!absl::ParseDuration(flags.lease, &options.lease.duration)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--lease must be a duration such as 30s, got '", flags.lease, "'"));
  }
  if (!absl::ParseDuration(flags.poll, &options.poll)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--poll must be a duration such as 500ms, got '", flags.poll, "'"));
  }
  LB_RETURN_IF_ERROR(options.Validate());
  return options;
}

// Ends this process with its parent, also if that is killed.
absl::Status EndWithParent(int parent) {
  if (parent == 0) return absl::OkStatus();
  if (prctl(PR_SET_PDEATHSIG, SIGTERM) != 0) {
    return absl::ErrnoToStatus(errno, "cannot ask to end with the parent");
  }
  if (getppid() == parent) return absl::OkStatus();
  return absl::CancelledError(absl::StrCat("process ", parent, " has ended already"));
}

sigset_t WatchedSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT}) sigaddset(&signals, number);
  return signals;
}

// Waits for SIGTERM or SIGINT; then the work has kStopPatience to come to its end.
void WatchSignals(jobs::StopSignal& stop, const jobs::StopSignal& done) {
  const sigset_t signals = WatchedSignals();
  const timespec poll = {0, 100'000'000};
  while (sigtimedwait(&signals, nullptr, &poll) < 0) {
    if (done.is_requested()) return;
  }
  base::LogInfo("stopping");
  stop.Request();
  if (done.WaitFor(kStopPatience)) return;
  base::LogInfo("the current stage takes long; ending without it");
  _exit(0);
}

absl::Status Run(const Flags& flags, const jobs::StopSignal& stop) {
  LB_ASSIGN_OR_RETURN(const jobs::JobLoopOptions options, LoopOptionsOf(flags));
  LB_RETURN_IF_ERROR(EndWithParent(flags.parent));
  LB_ASSIGN_OR_RETURN(const auto catalog, store::OpenSqliteCatalog(store::CatalogPath(flags.data)));
  LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(flags.data));
  const parallel::Arena arena(flags.threads);
  base::LogInfo(
      absl::StrCat(options.worker, " with ", arena.num_threads(), " threads on ", flags.data));
  return jobs::RunJobs(*catalog, *blobs, arena, stop, options);
}

int Main(const Flags& flags) {
  jobs::StopSignal stop;
  jobs::StopSignal done;
  std::thread watcher([&] { WatchSignals(stop, done); });
  const absl::Status status = Run(flags, stop);
  done.Request();
  watcher.join();
  if (status.ok()) return 0;
  base::LogError(status.ToString());
  return 1;
}

}  // namespace
}  // namespace liquidblend::worker

int main(int argc, char** argv) {
  using liquidblend::base::LogLevel;
  CLI::App app("Does liquidblend's jobs: imports and registrations");
  liquidblend::worker::Flags flags;
  liquidblend::worker::AddFlags(app, flags);
  CLI11_PARSE(app, argc, argv);
  // Before any thread exists, so that only WatchSignals() hears of them.
  const sigset_t signals = liquidblend::worker::WatchedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  liquidblend::base::ReturnLargeBlocks();
  liquidblend::base::StartLog("liquidblend-worker",
                              flags.verbose ? LogLevel::kDebug : LogLevel::kInfo);
  return liquidblend::worker::Main(flags);
}
