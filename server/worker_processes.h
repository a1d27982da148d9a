// Worker processes of a server: child processes that are restarted when they die, and that end with
// the server, however it ends.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::server {

struct WorkerProcessesOptions {
  std::string binary;                                    // path of liquidblend-worker
  std::vector<std::string> arguments;                    // of each process
  int count = 1;                                         // >= 0
  absl::Duration first_pause = absl::Milliseconds(200);  // before a restart; doubles each time ...
  absl::Duration longest_pause = absl::Seconds(30);      // ... up to this
  absl::Duration good_run = absl::Seconds(30);           // after such a run, pauses start again
};

// Threads: one thread alone, which must live as long as the process: the workers end when it does.
class WorkerProcesses {
 public:
  explicit WorkerProcesses(WorkerProcessesOptions options);
  ~WorkerProcesses();  // Stop() without patience
  WorkerProcesses(const WorkerProcesses&) = delete;
  WorkerProcesses& operator=(const WorkerProcesses&) = delete;

  // Reaps ended workers and starts those that are due. To be called on SIGCHLD, and after the time
  // that it returns.
  absl::Duration Tend();

  // Asks all to stop (SIGTERM) without waiting. Tend() starts none from now on.
  void AskToStop();

  // Waits until all have ended; kills those that still run after `patience`.
  void Stop(absl::Duration patience);

 private:
  struct Worker {
    pid_t pid = 0;  // 0: not running
    base::SteadyClock::time_point started;
    base::SteadyClock::time_point next_start;  // at once
    absl::Duration pause;
  };

  void Start(Worker& worker);
  void NoteEnd(Worker& worker, int wait_status);
  bool ReapAll();  // false: some still run

  const WorkerProcessesOptions options_;
  std::vector<Worker> workers_;
  bool is_stopping_ = false;
};

// liquidblend-worker beside this program's own file; empty if that cannot be found out.
std::string WorkerBinaryBesideThis();

}  // namespace liquidblend::server
