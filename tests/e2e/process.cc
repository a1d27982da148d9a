#include "tests/e2e/process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <utility>

#include "tests/paths.h"
#include "tests/process_state.h"

namespace liquidblend::e2e {
namespace {

std::vector<char*> PointersTo(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) pointers.push_back(string.data());
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

Process::Process(const std::string& program, const std::vector<std::string>& arguments,
                 const std::vector<std::string>& environment) {
  const std::string path = paths::Program(program);
  std::vector<std::string> words = {path};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) variables.push_back(*variable);
  variables.insert(variables.end(), environment.begin(), environment.end());

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) std::abort();
  output_ = ends[0];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  const int error = posix_spawn(&pid_, path.c_str(), &actions, nullptr, PointersTo(words).data(),
                                PointersTo(variables).data());
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) {
    std::cerr << "cannot start " << path << std::endl;
    std::abort();
  }
}

Process::~Process() { End(); }

Process::Process(Process&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)), output_(std::exchange(other.output_, -1)) {}

Process& Process::operator=(Process&& other) noexcept {
  End();
  pid_ = std::exchange(other.pid_, 0);
  output_ = std::exchange(other.output_, -1);
  return *this;
}

void Process::End() {
  if (pid_ != 0) Kill();
  if (output_ >= 0) close(std::exchange(output_, -1));
}

std::string Process::ReadLine() {
  std::string line;
  char c = 0;
  while (read(output_, &c, 1) == 1 && c != '\n') line += c;
  return line;
}

void Process::Signal(int number) const { kill(pid_, number); }

int Process::Wait() {
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
}

int Process::Kill() {
  Signal(SIGKILL);
  return Wait();
}

std::vector<pid_t> ChildrenOf(pid_t pid) {
  const std::string id = std::to_string(pid);
  std::ifstream file("/proc/" + id + "/task/" + id + "/children");
  std::vector<pid_t> children;
  pid_t child = 0;
  while (file >> child) children.push_back(child);
  return children;
}

int Slowness() {
  const char* const seconds = std::getenv("LIQUIDBLEND_E2E_PATIENCE");
  return seconds == nullptr ? 1 : std::max(1, std::atoi(seconds) / 60);
}

std::chrono::seconds Patience() {
  return std::max<std::chrono::seconds>(std::chrono::minutes(3),
                                        Slowness() * std::chrono::minutes(1));
}

bool IsAlive(pid_t pid) {
  const char state = StateOf(pid);
  return state != 'Z' && state != 'X';
}

}  // namespace liquidblend::e2e
