#include "client/cli/exit_code.h"

namespace liquidblend::cli {

ExitCode ToExitCode(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kExitOk;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      return kExitUsage;
    case absl::StatusCode::kUnavailable:
      return kExitUnreachable;
    case absl::StatusCode::kNotFound:
      return kExitNotFound;
    case absl::StatusCode::kCancelled:
      return kExitCancelled;
    default:
      return kExitFailed;
  }
}

const char* Advice(ExitCode code) {
  switch (code) {
    case kExitUnreachable:
      return "Is liquidblend-server running? Say where with --server HOST:PORT or "
             "LIQUIDBLEND_SERVER.";
    case kExitNotFound:
      return "`liquidblend list` shows what the server has.";
    case kExitUsage:
      return "`liquidblend COMMAND --help` explains every flag.";
    default:
      return "";
  }
}

}  // namespace liquidblend::cli
