#include "tests/cluster/fake_workers.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog.h"
#include "worker/jobs/attempt/lease_keeper.h"
#include "worker/jobs/attempt/publish.h"
#include "worker/jobs/attempt/stop_signal.h"

namespace liquidblend::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr absl::Duration kLease = absl::Seconds(30);  // the worker's defaults
constexpr absl::Duration kPoll = absl::Seconds(5);
constexpr int64_t kMemory = int64_t{64} << 30;  // that each of them can hold
constexpr absl::Duration kStopPoll = absl::Milliseconds(100);
constexpr absl::Duration kAfterError = absl::Milliseconds(500);
constexpr absl::Duration kRestart = absl::Seconds(2);         // as deploy/systemd has it
constexpr absl::Duration kBetweenReports = absl::Seconds(2);  // of progress

double SecondsOf(Clock::time_point time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}
double MsSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void Append(const WorkReport& one, WorkReport& all) {
  const auto append = [](const std::vector<double>& from, std::vector<double>& to) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(one.leased_s, all.leased_s);
  append(one.lease_ms, all.lease_ms);
  append(one.publish_ms, all.publish_ms);
  all.num_published += one.num_published;
  all.num_later_attempts += one.num_later_attempts;
  all.num_lost += one.num_lost;
  all.num_errors += one.num_errors;
  all.num_failed_starts += one.num_failed_starts;
  all.num_failed_looks += one.num_failed_looks;
}

// Sleeps for the time of a job, with reports of progress.
void Pretend(jobs::LeaseKeeper& keeper, absl::Duration job, const jobs::StopSignal& stop) {
  absl::Duration done;
  while (done < job && keeper.Check().ok()) {
    const absl::Duration step = std::min(kBetweenReports, job - done);
    if (stop.WaitFor(step)) return;
    done += step;
    store::pb::JobProgress progress;
    progress.set_stage("pretending");
    progress.set_fraction(absl::FDivDuration(done, job));
    keeper.Report(progress);
  }
}

void RunJob(store::Catalog& catalog, const store::Lease& lease, absl::Duration job,
            const jobs::StopSignal& stop, WorkReport& report) {
  if (lease.job.attempts() > 1) ++report.num_later_attempts;
  jobs::LeaseKeeper keeper(catalog, lease, stop, {.duration = kLease});
  Pretend(keeper, job, stop);
  store::pb::AnimationRecord animation;
  animation.set_id(lease.job.import_animation().animation());
  animation.set_blob(absl::StrCat("blob-of-", animation.id()));
  animation.mutable_manifest()->set_num_frames(1);
  const Clock::time_point begin = Clock::now();
  const absl::Status published = jobs::PublishWhileLeased(
      keeper, [&] { return catalog.PublishAnimation(lease.lease_id, animation); });
  if (stop.is_requested() && !published.ok()) return;
  report.publish_ms.push_back(MsSince(begin));
  if (published.ok()) {
    ++report.num_published;
  } else if (absl::IsAborted(published)) {
    ++report.num_lost;
  } else {
    ++report.num_errors;
  }
}

// Opens the catalog; as often as it takes, as what restarts workers does. Null: stopped before.
std::unique_ptr<store::Catalog> Open(const FakeWorkersOptions& options,
                                     const jobs::StopSignal& stop, WorkReport& report) {
  while (!stop.is_requested()) {
    absl::StatusOr<std::unique_ptr<store::Catalog>> opened =
        store::OpenPostgresCatalog(options.url);
    if (opened.ok()) return *std::move(opened);
    ++report.num_failed_starts;
    stop.WaitFor(kRestart);
  }
  return nullptr;
}

// Waits for a job, at most kPoll. Errors: the catalog's.
absl::Status AwaitJob(store::Catalog& catalog, const jobs::StopSignal& stop) {
  const Clock::time_point begin = Clock::now();
  while (!stop.is_requested() && absl::Milliseconds(MsSince(begin)) < kPoll) {
    LB_ASSIGN_OR_RETURN(const bool has_job, catalog.WaitForJob(kStopPoll, kMemory));
    if (has_job) break;
  }
  return absl::OkStatus();
}

// A worker's loop, as jobs::RunJobs() has it.
WorkReport Work(const FakeWorkersOptions& options, int number, const jobs::StopSignal& stop) {
  WorkReport report;
  stop.WaitFor(options.start * number / options.num_workers);
  const std::unique_ptr<store::Catalog> opened = Open(options, stop, report);
  if (opened == nullptr) return report;
  store::Catalog& catalog = *opened;
  std::mt19937 random(number);
  std::uniform_real_distribution<double> share(0.5, 1.5);
  const std::string name = absl::StrCat("fake:", number);
  while (!stop.is_requested()) {
    const Clock::time_point begin = Clock::now();
    const auto lease = catalog.LeaseJob(name, kLease, kMemory);
    if (lease.ok() && lease->has_value()) {
      report.lease_ms.push_back(MsSince(begin));
      report.leased_s.push_back(SecondsOf(Clock::now()));
      RunJob(catalog, **lease, share(random) * options.job, stop, report);
    } else if (!lease.ok() || !AwaitJob(catalog, stop).ok()) {
      ++report.num_errors;
      stop.WaitFor(kAfterError);
    }
  }
  return report;
}

// ---- reports through a pipe

void WriteAll(int file, const void* data, size_t size) {
  const char* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(file, bytes, size);
    if (written <= 0) _exit(1);
    bytes += written;
    size -= static_cast<size_t>(written);
  }
}

bool ReadAll(int file, void* data, size_t size) {
  char* bytes = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = read(file, bytes, size);
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

void Send(const WorkReport& report, int file) {
  for (const auto* numbers : {&report.leased_s, &report.lease_ms, &report.publish_ms}) {
    const uint64_t count = numbers->size();
    WriteAll(file, &count, sizeof(count));
    WriteAll(file, numbers->data(), count * sizeof(double));
  }
  for (const int64_t number : {report.num_published, report.num_later_attempts, report.num_lost,
                               report.num_errors, report.num_failed_starts}) {
    WriteAll(file, &number, sizeof(number));
  }
}

absl::StatusOr<WorkReport> Receive(int file) {
  WorkReport report;
  bool is_whole = true;
  for (auto* numbers : {&report.leased_s, &report.lease_ms, &report.publish_ms}) {
    uint64_t count = 0;
    is_whole = is_whole && ReadAll(file, &count, sizeof(count));
    numbers->resize(is_whole ? count : 0);
    is_whole = is_whole && ReadAll(file, numbers->data(), count * sizeof(double));
  }
  for (int64_t* number : {&report.num_published, &report.num_later_attempts, &report.num_lost,
                          &report.num_errors, &report.num_failed_starts}) {
    is_whole = is_whole && ReadAll(file, number, sizeof(*number));
  }
  if (is_whole) return report;
  return absl::InternalError("a process of fake workers ended without its report");
}

// ---- processes

struct Process {
  pid_t pid = 0;
  int report = -1;  // to read from
  int stop = -1;    // a byte stops it
};

// Runs the workers [first, first + count) until there is a byte in `stop`; writes what they saw.
void RunProcess(const FakeWorkersOptions& options, int first, int count, int stop, int report) {
  jobs::StopSignal signal;
  std::mutex mutex;
  WorkReport all;
  std::vector<std::thread> threads;
  for (int k = first; k < first + count; ++k) {
    threads.emplace_back([&, k] {
      const WorkReport one = Work(options, k, signal);
      const std::lock_guard<std::mutex> lock(mutex);
      Append(one, all);
    });
  }
  char byte = 0;
  ReadAll(stop, &byte, 1);
  signal.Request();
  for (std::thread& thread : threads) thread.join();
  Send(all, report);
}

absl::StatusOr<Process> Start(const FakeWorkersOptions& options, int first, int count) {
  int report[2];
  int stop[2];
  if (pipe2(report, O_CLOEXEC) != 0 || pipe2(stop, O_CLOEXEC) != 0) {
    return absl::ErrnoToStatus(errno, "cannot make a pipe");
  }
  const pid_t pid = fork();
  if (pid < 0) return absl::ErrnoToStatus(errno, "cannot start a process");
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    close(report[0]);
    close(stop[1]);
    RunProcess(options, first, count, stop[0], report[1]);
    _exit(0);
  }
  close(report[1]);
  close(stop[0]);
  return Process{pid, report[0], stop[1]};
}

absl::StatusOr<WorkReport> Stop(const Process& process) {
  WriteAll(process.stop, "s", 1);
  close(process.stop);
  absl::StatusOr<WorkReport> report = Receive(process.report);
  close(process.report);
  int status = 0;
  waitpid(process.pid, &status, 0);
  return report;
}

absl::StatusOr<bool> IsDone(store::Catalog& catalog) {
  LB_ASSIGN_OR_RETURN(const store::JobCounts counts, catalog.CountJobs());
  return !counts.contains(store::pb::JobRecord::QUEUED) &&
         !counts.contains(store::pb::JobRecord::RUNNING);
}

// Returns when no job is queued or running. A call that fails is counted in `report`.
absl::Status AwaitEmptyQueue(const FakeWorkersOptions& options, WorkReport& report) {
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<store::Catalog> catalog,
                      store::OpenPostgresCatalog(options.url));
  const Clock::time_point begin = Clock::now();
  while (absl::Milliseconds(MsSince(begin)) < options.give_up) {
    const absl::StatusOr<bool> is_done = IsDone(*catalog);
    if (is_done.ok() && *is_done) return absl::OkStatus();
    const absl::Status looked = is_done.ok() ? options.look(*catalog) : is_done.status();
    if (!looked.ok()) {
      ++report.num_failed_looks;
      std::fprintf(stderr, "while workers work: %s\n", looked.ToString().c_str());
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));
  }
  return absl::DeadlineExceededError("the queue is not empty yet");
}

}  // namespace

absl::StatusOr<WorkReport> RunFakeWorkers(const FakeWorkersOptions& options) {
  std::vector<Process> processes;
  for (int k = 0; k < options.num_processes; ++k) {
    const int first = options.num_workers * k / options.num_processes;
    const int end = options.num_workers * (k + 1) / options.num_processes;
    LB_ASSIGN_OR_RETURN(processes.emplace_back(), Start(options, first, end - first));
  }
  WorkReport all;
  const absl::Status emptied = AwaitEmptyQueue(options, all);
  absl::Status reported;
  for (const Process& process : processes) {
    const absl::StatusOr<WorkReport> one = Stop(process);
    if (one.ok()) Append(*one, all);
    if (!one.ok()) reported = one.status();
  }
  LB_RETURN_IF_ERROR(emptied);
  LB_RETURN_IF_ERROR(reported);
  return all;
}

}  // namespace liquidblend::bench
