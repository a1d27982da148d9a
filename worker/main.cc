// liquidblend-worker: leases jobs from the queue and runs them.
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/cores.h"
#include "core/base/exit_status.h"
#include "core/base/log.h"
#include "core/base/memory.h"
#include "core/base/memory_limit.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/base/version.h"
#include "core/parallel/arena.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/catalog/retry.h"
#include "core/store/open_store.h"
#include "core/trace/tracer.h"
#include "worker/jobs/attempt/stop_signal.h"
#include "worker/jobs/run_jobs.h"

namespace liquidblend::worker {
namespace {

// A stage that does not listen is given so long to end after SIGTERM. Its job is back in the queue
// by then (LeaseKeeper), so nothing is lost when the process just ends.
constexpr absl::Duration kStopPatience = absl::Seconds(3);
constexpr absl::Duration kLongestOpenPause = absl::Minutes(1);
// So long before --max-time is over the worker stops as after SIGTERM: a second for the last
// checkpoint, kStopPatience, and a second to spare.
constexpr absl::Duration kStopBeforeMaxTime = absl::Seconds(5);

struct Flags {
  store::StoreLocation store;
  int threads = 0;  // 0: its share of the cores
  int cores_shared_by = 1;
  int64_t memory = 0;  // 0: base::MemoryForJobs()
  std::string lease = "30s";
  std::string poll = "5s";
  int checkpoint_iterations = 2;
  std::string checkpoint_interval = "10s";
  bool once = false;
  bool drain = false;
  std::string idle_time = "30s";
  int max_jobs = 0;      // 0: any number
  std::string max_time;  // empty: none
  int stopped_status = base::kExitDone;
  bool check = false;
  int parent = 0;  // 0: none
  std::string log_format = "text";
  bool verbose = false;
};

// When the worker ends by itself.
void AddFlagsOfItsEnd(CLI::App& app, Flags& flags) {
  auto* const once =
      app.add_flag("--once", flags.once,
                   "Exit as soon as there is nothing to do; with an error if the store is away");
  auto* const drain =
      app.add_flag("--drain", flags.drain,
                   "Exit 0 once there was nothing to do for --idle-time: for tasks of a farm")
          ->envname("LIQUIDBLEND_DRAIN")
          ->excludes(once);
  app.add_option("--idle-time", flags.idle_time,
                 "With --drain: how long to wait for more; at least --lease, so that a job of a "
                 "worker that was killed meanwhile is not left behind")
      ->envname("LIQUIDBLEND_IDLE_TIME")
      ->needs(drain)
      ->capture_default_str();
  app.add_option("--max-jobs", flags.max_jobs, "End after so many jobs; 0: any number")
      ->envname("LIQUIDBLEND_MAX_JOBS")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  app.add_option("--max-time", flags.max_time,
                 "End within this time, e.g. 2h: 5s before it is over the job goes back with a "
                 "checkpoint; no limit unless given")
      ->envname("LIQUIDBLEND_MAX_TIME");
  app.add_option("--stopped-status", flags.stopped_status,
                 "Exit status of a worker that a signal, --max-time or --max-jobs has ended, so "
                 "that a farm's script can run the task again")
      ->envname("LIQUIDBLEND_STOPPED_STATUS")
      ->check(CLI::Range(0, 125))
      ->capture_default_str();
}

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("--data", flags.store.data,
                 "Directory of the server whose jobs to do; needed unless given in the environment "
                 "(Env:LIQUIDBLEND_DATA, which does not count with --store)");
  app.add_option("--store", flags.store.catalog_url,
                 "postgresql://..., shared by many machines; otherwise --data")
      ->envname("LIQUIDBLEND_STORE");
  app.add_option("--blobs", flags.store.blobs_url,
                 "With --store, which needs it: s3://bucket/prefix; none unless given")
      ->envname("LIQUIDBLEND_BLOBS");
  app.add_option(
      "--cache", flags.store.cache,
      "With --store, which needs it: directory for blobs that are in use; none unless given "
      "(Env:LIQUIDBLEND_CACHE)");
  app.add_option("--cache-size", flags.store.cache_bytes, "Disk space for --cache, e.g. 64GiB")
      ->envname("LIQUIDBLEND_CACHE_SIZE")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.store.cache_bytes));
  app.add_option("--threads", flags.threads, "Threads; 0: the cores divided by --cores-shared-by")
      ->envname("LIQUIDBLEND_THREADS")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option(
         "--cores-shared-by", flags.cores_shared_by,
         "Workers on this machine in all, those of a server counted; each takes its share; 0: "
         "none but this")
      ->envname("LIQUIDBLEND_CORES_SHARED_BY")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option(
         "--memory", flags.memory,
         "What a job may need, e.g. 8GiB; larger ones are left to others; 0: four fifths of "
         "the machine's or container's memory")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.memory));
  app.add_option("--lease", flags.lease, "How long a job waits for this worker without a heartbeat")
      ->capture_default_str();
  app.add_option(
         "--poll", flags.poll,
         "The longest time between two tries to lease a job while the queue is empty; a new job "
         "is noticed at once")
      ->capture_default_str();
  app.add_option("--checkpoint-iterations", flags.checkpoint_iterations,
                 "Save a checkpoint of a registration after so many iterations; 0: never")
      ->envname("LIQUIDBLEND_CHECKPOINT_ITERATIONS")
      ->capture_default_str();
  app.add_option("--checkpoint-interval", flags.checkpoint_interval,
                 "... but no sooner after the last time")
      ->envname("LIQUIDBLEND_CHECKPOINT_INTERVAL")
      ->capture_default_str();
  AddFlagsOfItsEnd(app, flags);
  app.add_flag(
      "--check", flags.check,
      "Exit 0 if the store can be reached from here, 2 for a flag that is refused, else 1");
  app.add_option("--parent", flags.parent, "Process to end with; none unless given");
  app.add_option("--log-format", flags.log_format, "text, or json: an object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_flag("--verbose", flags.verbose, "Log details");
}

std::string WorkerName() {
  std::array<char, 256> host = {};
  if (gethostname(host.data(), host.size() - 1) != 0) host = {'?'};
  return absl::StrCat(host.data(), ":", getpid());
}

absl::StatusOr<absl::Duration> DurationOf(const std::string& flag, const std::string& value) {
  absl::Duration duration;
  if (absl::ParseDuration(value, &duration)) return duration;
  return absl::InvalidArgumentError(
      absl::StrCat(flag, " must be a duration such as 500ms or 30s, got '", value, "'"));
}

absl::StatusOr<jobs::JobLoopOptions> LoopOptionsOf(const Flags& flags) {
  jobs::JobLoopOptions options;
  options.worker = WorkerName();
  options.max_jobs = flags.max_jobs;
  options.checkpoints.iterations = flags.checkpoint_iterations;
  LB_ASSIGN_OR_RETURN(options.lease.duration, DurationOf("--lease", flags.lease));
  LB_ASSIGN_OR_RETURN(options.poll, DurationOf("--poll", flags.poll));
  LB_ASSIGN_OR_RETURN(options.checkpoints.interval,
                      DurationOf("--checkpoint-interval", flags.checkpoint_interval));
  LB_ASSIGN_OR_RETURN(const absl::Duration idle_time, DurationOf("--idle-time", flags.idle_time));
  if (flags.drain) options.idle_time = idle_time;
  if (flags.once) options.idle_time = absl::ZeroDuration();
  if (flags.memory != 0) options.memory_bytes = flags.memory;
  if (flags.memory == 0 && base::MemoryForJobs() > 0) options.memory_bytes = base::MemoryForJobs();
  LB_RETURN_IF_ERROR(options.Validate());
  return options;
}

// How long the worker may work before it has to stop because of --max-time.
absl::StatusOr<absl::Duration> TimeToWork(const Flags& flags) {
  if (flags.max_time.empty()) return absl::InfiniteDuration();
  LB_ASSIGN_OR_RETURN(const absl::Duration max_time, DurationOf("--max-time", flags.max_time));
  if (max_time > kStopBeforeMaxTime) return max_time - kStopBeforeMaxTime;
  return absl::InvalidArgumentError(
      absl::StrCat("--max-time must be longer than the ", absl::FormatDuration(kStopBeforeMaxTime),
                   " that a worker has to stop, got '", flags.max_time, "'"));
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
  for (const int number : {SIGTERM, SIGINT, SIGUSR1}) sigaddset(&signals, number);
  return signals;
}

// Why the worker has to stop: a signal, or the end of its time. Empty: it is done before.
std::string AwaitReasonToStop(absl::Duration time_to_work, const jobs::StopSignal& done) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  const sigset_t signals = WatchedSignals();
  const timespec poll = {0, 100'000'000};
  while (!done.is_requested()) {
    const int number = sigtimedwait(&signals, nullptr, &poll);
    if (number > 0) return absl::StrCat("SIG", sigabbrev_np(number));
    if (base::Since(begin) >= time_to_work) return "--max-time is nearly over";
  }
  return "";
}

// Waits for a reason to stop; then the work has kStopPatience to come to its end.
void WatchOver(absl::Duration time_to_work, int stopped_status, jobs::StopSignal& stop,
               const jobs::StopSignal& done) {
  const std::string reason = AwaitReasonToStop(time_to_work, done);
  if (reason.empty()) return;
  stop.Request();
  base::LogInfo(absl::StrCat("stopping: ", reason));
  if (done.WaitFor(kStopPatience)) return;
  base::LogInfo("the current stage takes long; ending without it");
  _exit(stopped_status);
}

// Opens a store, with new attempts while it is away or refuses access; `report` is called with each
// failure, each new one is logged.  Errors: other ones; kCancelled after a request to stop.
template <typename Open>
std::invoke_result_t<Open> OpenPatiently(const jobs::StopSignal& stop, const Open& open,
                                         const std::function<void(const absl::Status&)>& report) {
  store::RetryOptions pauses;
  pauses.longest_pause = kLongestOpenPause;
  std::string last_message;
  for (int num_failures = 1;; ++num_failures) {
    auto opened = open();
    if (opened.ok() || !base::IsTransient(opened.status())) return opened;
    if (opened.status().message() != last_message) {
      base::LogWarning(absl::StrCat("waits for its store: ", opened.status().ToString()));
    }
    last_message = std::string(opened.status().message());
    report(opened.status());
    if (stop.WaitFor(store::PauseAfter(num_failures, pauses))) {
      return absl::CancelledError("asked to stop before the store could be opened");
    }
  }
}

absl::StatusOr<store::Store> OpenStorePatiently(const Flags& flags,
                                                const jobs::JobLoopOptions& options,
                                                const jobs::StopSignal& stop) {
  LB_RETURN_IF_ERROR(flags.store.Validate());
  store::Store store;
  LB_ASSIGN_OR_RETURN(store.name, store::NameOfStore(flags.store));
  LB_ASSIGN_OR_RETURN(store.catalog, OpenPatiently(
                                         stop, [&] { return store::OpenCatalog(flags.store); },
                                         [](const absl::Status&) {}));
  const auto record = [&](const absl::Status& refusal) {
    jobs::RecordRefusal(*store.catalog, options, refusal);
  };
  LB_ASSIGN_OR_RETURN(store.blobs,
                      OpenPatiently(
                          stop, [&] { return store::OpenBlobs(flags.store); }, record));
  return store;
}

std::string ProgramVersion() {
  return base::VersionLine("liquidblend-worker", store::DescribeTables());
}

absl::StatusOr<jobs::LoopEnd> Run(const Flags& flags, const jobs::StopSignal& stop) {
  LB_ASSIGN_OR_RETURN(jobs::JobLoopOptions options, LoopOptionsOf(flags));
  LB_RETURN_IF_ERROR(EndWithParent(flags.parent));
  if (!flags.check) base::LogInfo(ProgramVersion());
  const bool is_patient = !flags.check && !flags.once;
  store::SurviveUnreadablePages();
  const absl::StatusOr<store::Store> opened =
      is_patient ? OpenStorePatiently(flags, options, stop) : store::OpenStore(flags.store);
  if (stop.is_requested()) return jobs::LoopEnd::kStopped;
  if (!opened.ok()) return opened.status();
  const store::Store& store = *opened;
  const absl::Status reachable = store::CheckReachable(*store.catalog, *store.blobs);
  if ((flags.check || flags.once) && !reachable.ok()) return reachable;
  if (flags.check) return jobs::LoopEnd::kDrained;  // all is well
  if (base::IsTransient(reachable)) options.refusal = reachable;
  const int share = base::ShareOfCores(base::NumCores(), flags.cores_shared_by);
  const parallel::Arena arena(flags.threads > 0 ? flags.threads : share);
  base::LogInfo(absl::StrCat(options.worker, " with ", arena.num_threads(), " threads and ",
                             base::FormatGibibytes(options.memory_bytes), " on ", store.name));
  const std::unique_ptr<trace::Tracer> tracer =
      trace::Tracer::Open({"liquidblend-worker", base::Version()}, base::LogWarning);
  options.tracer = tracer.get();
  absl::StatusOr<jobs::LoopEnd> end =
      jobs::RunJobs(*store.catalog, *store.blobs, arena, stop, options);
  tracer->Stop();
  return end;
}

int Main(const Flags& flags) {
  jobs::StopSignal stop;
  jobs::StopSignal done;
  const absl::StatusOr<absl::Duration> time_to_work = TimeToWork(flags);
  std::thread watcher([&] {
    WatchOver(time_to_work.value_or(absl::InfiniteDuration()), flags.stopped_status, stop, done);
  });
  const absl::StatusOr<jobs::LoopEnd> end =
      time_to_work.ok() ? Run(flags, stop) : time_to_work.status();
  done.Request();
  watcher.join();
  if (end.ok()) return *end == jobs::LoopEnd::kDrained ? base::kExitDone : flags.stopped_status;
  base::LogError(end.status().ToString());
  return flags.check ? base::ExitStatusOfCheck(end.status()) : base::ExitStatusOf(end.status());
}

}  // namespace
}  // namespace liquidblend::worker

int main(int argc, char** argv) {
  using liquidblend::base::LogLevel;
  CLI::App app("Does liquidblend's jobs: imports and registrations");
  liquidblend::worker::Flags flags;
  liquidblend::worker::AddFlags(app, flags);
  app.set_version_flag("--version", liquidblend::worker::ProgramVersion());
  app.footer(liquidblend::base::kExitStatusHelp);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? liquidblend::base::kExitDone : liquidblend::base::kExitUsage;
  }
  liquidblend::store::TakeFromEnvironment(flags.store);
  // Before any thread exists, so that only WatchOver() hears of them.
  const sigset_t signals = liquidblend::worker::WatchedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  liquidblend::base::ReturnLargeBlocks();
  liquidblend::base::StartLog("liquidblend-worker",
                              flags.verbose ? LogLevel::kDebug : LogLevel::kInfo,
                              *liquidblend::base::ParseLogFormat(flags.log_format));
  return liquidblend::worker::Main(flags);
}
