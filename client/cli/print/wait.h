// Watching an operation to its end.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/flags/context.h"
#include "liquidblend/client.h"

namespace liquidblend::cli {

// Shows progress until the operation ends in any way. Ctrl-C ends the program with
// kExitInterrupted; the operation goes on, and a line tells the user how to watch or cancel it.
absl::StatusOr<Operation> WatchWithProgress(Client& client, const std::string& operation,
                                            const Context& context);

// kCancelled if it was cancelled; VerdictError() if its verdict was worse than required; kAborted,
// with the reason, if it failed otherwise. Requires: it is done.
absl::Status FailureOf(const Operation& operation);

// WatchWithProgress(). Errors: FailureOf()'s; the client's.
absl::StatusOr<Operation> WaitWithProgress(Client& client, const std::string& operation,
                                           const Context& context);

// VerdictError() if the operation is a registration that has published a target too different from
// its source. Requires: it is done.
absl::Status CheckVerdict(const Operation& operation);

// "registration of target 1, iteration 7/20, fit 0.0123, smoothness 0.0045, inliers 91 %, 1:05
// left": a line without control characters.
std::string DescribeProgress(const Progress& progress);

// "`liquidblend operations ID --wait` watches it, `liquidblend cancel ID` cancels it."; without
// commands to copy if the server's name for it is not safe there (client::IsSafeToPaste).
std::string HowToWatch(const std::string& operation);

}  // namespace liquidblend::cli
