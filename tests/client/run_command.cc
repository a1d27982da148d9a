#include "tests/client/run_command.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

#include "absl/strings/match.h"
#include "tests/client/temp_files.h"
#include "tests/paths.h"

namespace liquidblend::testing {
namespace {

// This process's environment without LIQUIDBLEND_SERVER.
std::vector<char*> Environment() {
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (!absl::StartsWith(*variable, "LIQUIDBLEND_SERVER=")) variables.push_back(*variable);
  }
  variables.push_back(nullptr);
  return variables;
}

// Starts the command with these files as its output. A child of fork() could not do it here: other
// threads of this process may hold the locks of a sanitizer's allocator.
pid_t Start(const std::vector<std::string>& arguments, int out, int err) {
  const std::string program = paths::Program("liquidblend");
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  pid_t child = -1;
  const int error =
      posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), Environment().data());
  posix_spawn_file_actions_destroy(&actions);
  close(out);
  close(err);
  if (error != 0) abort();
  return child;
}

int OpenToWrite(const std::string& path) {
  return open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
}

int WaitForExit(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

// Calls `action` with the command's process once standard error holds `text`.
CommandResult RunUntil(const std::vector<std::string>& arguments, const std::string& text,
                       const std::function<void(pid_t child)>& action) {
  int err[2];
  if (pipe2(err, O_CLOEXEC) != 0) abort();  // what `action` starts does not hold it open
  const pid_t child = Start(arguments, OpenToWrite("/dev/null"), err[1]);
  CommandResult result;
  bool is_done = false;
  char buffer[512];
  for (ssize_t size = 0; (size = read(err[0], buffer, sizeof(buffer))) > 0;) {
    result.err.append(buffer, static_cast<size_t>(size));
    if (is_done || result.err.find(text) == std::string::npos) continue;
    action(child);
    is_done = true;
  }
  close(err[0]);
  result.exit_code = WaitForExit(child);
  return result;
}

}  // namespace

CommandResult RunLiquidblend(const std::vector<std::string>& arguments) {
  const TempDir dir;
  const std::string out = dir.File("out");
  const std::string err = dir.File("err");
  const pid_t child = Start(arguments, OpenToWrite(out), OpenToWrite(err));
  const int exit_code = WaitForExit(child);
  return {exit_code, ReadBytes(out), ReadBytes(err)};
}

CommandResult InterruptLiquidblend(const std::vector<std::string>& arguments,
                                   const std::string& text) {
  return RunUntil(arguments, text, [](pid_t child) { kill(child, SIGINT); });
}

CommandResult RunLiquidblendUntil(const std::vector<std::string>& arguments,
                                  const std::string& text, const std::function<void()>& action) {
  return RunUntil(arguments, text, [&](pid_t) { action(); });
}

}  // namespace liquidblend::testing
