// A program under test, as a child process.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

namespace liquidblend::e2e {

// Threads: one at a time. Not waited for at the end: killed.
class Process {
 public:
  // Nothing that runs.
  Process() = default;
  // Runs that program of ours (tests/paths.h); `environment` is added to this process' own, as
  // NAME=VALUE. What it says on standard error goes to ours.
  Process(const std::string& program, const std::vector<std::string>& arguments,
          const std::vector<std::string>& environment = {});
  ~Process();
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;

  pid_t pid() const { return pid_; }

  // The next line of its standard output, without the newline; "" if it has ended.
  std::string ReadLine();

  void Signal(int number) const;
  // Waits for its end. Exit code, or minus the signal that killed it.
  int Wait();
  int Kill();  // with SIGKILL; then Wait()

 private:
  void End();

  pid_t pid_ = 0;  // 0: waited for
  int output_ = -1;
};

// Direct children of a process.
std::vector<pid_t> ChildrenOf(pid_t pid);

// How many times as long as usual programs take, under a sanitizer: 1, or the minutes in the
// environment variable LIQUIDBLEND_E2E_PATIENCE, which is in seconds.
int Slowness();

// How long a test waits for what must happen: three minutes, as a busy machine may need for a whole
// registration, or as many as Slowness() if that is more.
std::chrono::seconds Patience();

// Whether there is such a process (a zombie does not count).
bool IsAlive(pid_t pid);

}  // namespace liquidblend::e2e
