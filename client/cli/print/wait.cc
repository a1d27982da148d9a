#include "client/cli/print/wait.h"

#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "client/cli/flags/clean_text.h"
#include "client/cli/print/exit_code.h"
#include "client/cli/print/progress_bar.h"
#include "client/src/names.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

// A signal handler can reach nothing but globals.
char interrupt_message[512];

void OnInterrupt(int) {
  // Nothing can be done here if the terminal is gone.
  [[maybe_unused]] const ssize_t written =
      write(STDERR_FILENO, interrupt_message, std::strlen(interrupt_message));
  _exit(kExitInterrupted);
}

// While it lives, Ctrl-C says how to go on and ends the program.
class InterruptHint {
 public:
  explicit InterruptHint(const std::string& message) {
    const size_t length = message.copy(interrupt_message, sizeof(interrupt_message) - 1);
    interrupt_message[length] = '\0';
    previous_ = std::signal(SIGINT, OnInterrupt);
  }
  ~InterruptHint() { std::signal(SIGINT, previous_); }
  InterruptHint(const InterruptHint&) = delete;
  InterruptHint& operator=(const InterruptHint&) = delete;

 private:
  void (*previous_)(int) = SIG_DFL;
};

void AppendEnergies(const Progress& progress, std::string* text) {
  absl::StrAppendFormat(text, ", iteration %d/%d, fit %.4g, smoothness %.4g", progress.iteration,
                        progress.num_iterations, progress.fit_energy, progress.smoothness_energy);
  if (progress.num_samples > 0) {
    absl::StrAppendFormat(text, ", inliers %.0f %%",
                          100.0 * static_cast<double>(progress.num_inliers) /
                              static_cast<double>(progress.num_samples));
  }
}

}  // namespace

absl::Status FailureOf(const Operation& operation) {
  if (operation.result.ok()) return absl::OkStatus();
  if (absl::IsCancelled(operation.result)) {
    return absl::CancelledError(absl::StrCat(operation.name, " was cancelled"));
  }
  const std::string message = absl::StrCat(
      operation.subject.empty() ? operation.name : operation.subject, ": ",
      absl::StatusCodeToString(operation.result.code()), ": ", operation.result.message());
  if (operation.error_reason == "VERDICT_TOO_LOW") return VerdictError(message);
  return absl::AbortedError(message);
}

absl::Status CheckVerdict(const Operation& operation) {
  if (!operation.family.has_value()) return absl::OkStatus();
  const Family& family = *operation.family;
  const bool is_its_family = operation.version == 0 || operation.version == family.version;
  std::string reasons;
  for (const RegistrationReport& report : family.reports) {
    if (!is_its_family || report.verdict.grade != Grade::kTooDifferent) continue;
    absl::StrAppend(&reasons, reasons.empty() ? ": " : "; ", report.target, ": ",
                    report.verdict.reason);
  }
  if (reasons.empty() && operation.grade != Grade::kTooDifferent) return absl::OkStatus();
  const int64_t version = is_its_family ? family.version : operation.version;
  return VerdictError(absl::StrCat(family.name, " version ", version,
                                   " is published, but its animations are too different", reasons));
}

std::string DescribeProgress(const Progress& progress) {
  std::string text = progress.stage.empty() ? "starting" : progress.stage;
  if (progress.num_iterations > 0) {
    absl::StrAppend(&text, " of target ", int64_t{progress.target_index} + 1);
    AppendEnergies(progress, &text);
  }
  if (!progress.waiting_for.empty()) absl::StrAppend(&text, ": ", progress.waiting_for);
  if (progress.next_attempt_time) {
    absl::StrAppend(&text, " after attempt ", progress.attempt, ": ",
                    progress.last_failure.message(), "; next one at ",
                    absl::FormatTime("%H:%M:%S", *progress.next_attempt_time, absl::UTCTimeZone()),
                    " UTC");
  } else if (progress.attempt > 1) {
    absl::StrAppend(&text, ", attempt ", progress.attempt);
  }
  if (progress.handed_back > 0) {
    absl::StrAppend(&text, ", handed back ", progress.handed_back,
                    progress.handed_back == 1 ? " time" : " times");
  }
  if (progress.priority != 0) absl::StrAppend(&text, ", priority ", progress.priority);
  if (progress.seconds_left > 0.0) {
    absl::StrAppend(&text, ", ", FormatTimeLeft(progress.seconds_left), " left");
  }
  const bool is_after_failure = progress.attempt > 1 && !progress.last_failure.ok();
  if (is_after_failure && !progress.next_attempt_time) {  // at the end, as it may be long
    absl::StrAppend(&text, "; the attempt before: ", progress.last_failure.message());
  }
  return CleanLine(text);
}

std::string HowToWatch(const std::string& operation) {
  if (!client::IsSafeToPaste(operation)) {
    return "Its name is not one to copy; `liquidblend operations` lists all.";
  }
  return absl::StrCat("`liquidblend operations ", operation,
                      " --wait` watches it, `liquidblend cancel ", operation, "` cancels it.");
}

absl::StatusOr<Operation> WatchWithProgress(Client& client, const std::string& operation,
                                            const Context& context) {
  const InterruptHint hint(
      absl::StrCat("\n", CleanLine(operation), " goes on.\n", HowToWatch(operation), "\n"));
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  LBC_ASSIGN_OR_RETURN(
      Operation finished, client.WatchOperation(operation, [&](const Operation& now) {
        const Progress& progress = now.progress;
        const std::string step = absl::StrCat(progress.stage, " ", progress.target_index, " ",
                                              progress.iteration, " ", progress.attempt);
        if (!now.done) bar.Update(progress.fraction, step, DescribeProgress(progress));
        if (now.done && now.result.ok()) bar.Update(1.0, "done", "done");
        return true;
      }));
  bar.Finish();
  return finished;
}

absl::StatusOr<Operation> WaitWithProgress(Client& client, const std::string& operation,
                                           const Context& context) {
  LBC_ASSIGN_OR_RETURN(Operation finished, WatchWithProgress(client, operation, context));
  LBC_RETURN_IF_ERROR(FailureOf(finished));
  return finished;
}

}  // namespace liquidblend::cli
