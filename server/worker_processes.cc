#include "server/worker_processes.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(20);

// A child with default signals, that shares nothing but standard error with us: what it prints
// belongs into the log.
int Spawn(const std::string& binary, std::vector<std::string> arguments, pid_t& pid) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  const int error = posix_spawn(&pid, binary.c_str(), &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  return error;
}

std::string Describe(int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    return absl::StrCat("killed by signal ", WTERMSIG(wait_status), " (",
                        strsignal(WTERMSIG(wait_status)), ")");
  }
  return absl::StrCat("exit code ", WEXITSTATUS(wait_status));
}

}  // namespace

WorkerProcesses::WorkerProcesses(WorkerProcessesOptions options)
    : options_(std::move(options)), workers_(std::max(0, options_.count)) {
  for (Worker& worker : workers_) worker.pause = options_.first_pause;
}

WorkerProcesses::~WorkerProcesses() {
  AskToStop();
  Stop(absl::ZeroDuration());
}

absl::Duration WorkerProcesses::Tend() {
  ReapAll();
  if (is_stopping_) return absl::InfiniteDuration();
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  absl::Duration wait = absl::InfiniteDuration();
  for (Worker& worker : workers_) {
    if (worker.pid == 0 && worker.next_start <= now) Start(worker);
    if (worker.pid == 0) wait = std::min(wait, absl::FromChrono(worker.next_start - now));
  }
  return wait;
}

void WorkerProcesses::Start(Worker& worker) {
  std::vector<std::string> arguments = {options_.binary};
  arguments.insert(arguments.end(), options_.arguments.begin(), options_.arguments.end());
  arguments.push_back("--parent");
  arguments.push_back(absl::StrCat(getpid()));
  worker.started = base::SteadyClock::now();
  const int error = Spawn(options_.binary, std::move(arguments), worker.pid);
  if (error == 0) return base::LogInfo(absl::StrCat("worker ", worker.pid, " started"));
  worker.pid = 0;
  worker.next_start = worker.started + absl::ToChronoNanoseconds(worker.pause);
  worker.pause = std::min(2 * worker.pause, options_.longest_pause);
  base::LogError(absl::StrCat("cannot start '", options_.binary, "': ", std::strerror(error)));
}

void WorkerProcesses::NoteEnd(Worker& worker, int wait_status) {
  const std::string event = absl::StrCat("worker ", worker.pid, " ended: ", Describe(wait_status));
  worker.pid = 0;
  if (is_stopping_) return base::LogInfo(event);
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  if (absl::FromChrono(now - worker.started) >= options_.good_run)
    worker.pause = options_.first_pause;
  worker.next_start = now + absl::ToChronoNanoseconds(worker.pause);
  base::LogWarning(
      absl::StrCat(event, "; the next one starts in ", absl::FormatDuration(worker.pause)));
  worker.pause = std::min(2 * worker.pause, options_.longest_pause);
}

bool WorkerProcesses::ReapAll() {
  bool all_ended = true;
  for (Worker& worker : workers_) {
    int wait_status = 0;
    if (worker.pid != 0 && waitpid(worker.pid, &wait_status, WNOHANG) == worker.pid) {
      NoteEnd(worker, wait_status);
    }
    all_ended = all_ended && worker.pid == 0;
  }
  return all_ended;
}

void WorkerProcesses::AskToStop() {
  is_stopping_ = true;
  for (const Worker& worker : workers_) {
    if (worker.pid != 0) kill(worker.pid, SIGTERM);
  }
}

void WorkerProcesses::Stop(absl::Duration patience) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  while (!ReapAll()) {
    if (base::Since(begin) >= patience) {
      for (const Worker& worker : workers_) {
        if (worker.pid != 0) kill(worker.pid, SIGKILL);
      }
    }
    absl::SleepFor(kStopPoll);
  }
}

std::string WorkerBinaryBesideThis() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "" : (self.parent_path() / "liquidblend-worker").string();
}

}  // namespace liquidblend::server
