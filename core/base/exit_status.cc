#include "core/base/exit_status.h"

namespace liquidblend::base {

ExitStatus ExitStatusOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kExitDone;
    case absl::StatusCode::kInvalidArgument:
      return kExitUsage;
    case absl::StatusCode::kUnavailable:
      return kExitUnreachable;
    case absl::StatusCode::kDataLoss:
      return kExitDamaged;
    default:
      return kExitFailed;
  }
}

ExitStatus ExitStatusOfCheck(const absl::Status& status) {
  const ExitStatus exit_status = ExitStatusOf(status);
  return exit_status == kExitDone || exit_status == kExitUsage ? exit_status : kExitFailed;
}

}  // namespace liquidblend::base
