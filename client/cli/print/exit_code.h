// Exit statuses of the command.
#pragma once

#include <exception>
#include <string>

#include "absl/status/status.h"

namespace liquidblend::cli {

enum ExitCode {
  kExitOk = 0,
  kExitFailed = 1,         // the server or this machine could not do it, or a job failed
  kExitUsage = 2,          // a flag or value that is refused, here or by the server
  kExitUnreachable = 3,    // no server, or the connection was lost
  kExitNotFound = 4,       // no such animation, family, operation or file
  kExitCancelled = 5,      // the operation was cancelled
  kExitTooDifferent = 6,   // the verdict on a registration: too different, or worse than --require
  kExitDamaged = 7,        // read data are damaged, or missing in the store
  kExitInterrupted = 130,  // Ctrl-C; a running operation goes on
};

// The same, for --help.
inline constexpr char kExitCodeHelp[] =
    "Exit status: 0 done; 1 failed; 2 a flag or value that is refused; 3 no server, or the\n"
    "connection was lost; 4 no such animation, family, operation or file; 5 the operation was\n"
    "cancelled; 6 the verdict on a registration is too different, or worse than --require allows;\n"
    "7 what was read is damaged, or missing in the store; 130 Ctrl-C (a running operation goes\n"
    "on).";

// An error that is kExitTooDifferent.
absl::Status VerdictError(const std::string& message);

// The status of a command that something thrown has ended: kResourceExhausted without memory, else
// kInternal.
absl::Status StatusOfException(const std::exception& exception);

ExitCode ToExitCode(const absl::Status& status);

// Advice to the user about an error, in one sentence; "" if there is none.
const char* Advice(const absl::Status& status);

}  // namespace liquidblend::cli
