#include "client/cli/print/exit_code.h"

#include <new>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::cli {
namespace {

constexpr char kVerdictUrl[] = "liquidblend/verdict";  // marks what VerdictError() makes

}  // namespace

absl::Status VerdictError(const std::string& message) {
  absl::Status status = absl::FailedPreconditionError(message);
  status.SetPayload(kVerdictUrl, absl::Cord());
  return status;
}

absl::Status StatusOfException(const std::exception& exception) {
  if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) {
    return absl::ResourceExhaustedError("this machine has not enough memory for that");
  }
  return absl::InternalError(absl::StrCat("an unexpected error: ", exception.what()));
}

ExitCode ToExitCode(const absl::Status& status) {
  if (status.GetPayload(kVerdictUrl).has_value()) return kExitTooDifferent;
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
    case absl::StatusCode::kDataLoss:
      return kExitDamaged;
    default:
      return kExitFailed;
  }
}

const char* Advice(const absl::Status& status) {
  if (status.code() == absl::StatusCode::kUnauthenticated) {
    return "Give a token of this server's with --token-file FILE or LIQUIDBLEND_TOKEN_FILE.";
  }
  switch (ToExitCode(status)) {
    case kExitUnreachable:
      return "Is liquidblend-server running? Say where with --server HOST:PORT or "
             "LIQUIDBLEND_SERVER.";
    case kExitNotFound:
      return "`liquidblend list` shows what the server has; paths are those of this machine.";
    case kExitTooDifferent:
      return "`liquidblend inspect FAMILY` says where; correspondences may help "
             "(docs/correspondences.md).";
    case kExitUsage:
      return "`liquidblend COMMAND --help` explains every flag.";
    default:
      return "";
  }
}

}  // namespace liquidblend::cli
