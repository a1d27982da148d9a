// The exit statuses of the programs (docs/operations/running.md). The command line of
// clients has the same numbers (client/cli/print/exit_code.h).
#pragma once

#include "absl/status/status.h"

namespace liquidblend::base {

// Exit status of a program.
enum ExitStatus {
  kExitDone = 0,         // also: stopped as it was asked to
  kExitFailed = 1,       // this machine or the store could not do it
  kExitUsage = 2,        // a flag or value that is refused
  kExitUnreachable = 3,  // the store cannot be reached
  kExitDamaged = 7,      // something in the store or an export is damaged or missing
};

// Text for --help of programs that run until they are stopped.
inline constexpr char kExitStatusHelp[] =
    "Exit status: 0 stopped, or done; 1 failed; 2 a flag or value that is refused; 3 the store\n"
    "cannot be reached; 7 something in the store is damaged or missing. With --check: 0 all is\n"
    "well; 2 a flag or value that is refused; 1 anything else.";

// Exit status by the error's code: kInvalidArgument is usage, kUnavailable unreachable, kDataLoss
// damaged, all others failed.
ExitStatus ExitStatusOf(const absl::Status& status);

// Exit status of --check, which distinguishes only usage from other errors.
ExitStatus ExitStatusOfCheck(const absl::Status& status);

}  // namespace liquidblend::base
