// Reasons of errors for programs, "VERDICT_TOO_LOW" say: those of google.rpc.ErrorInfo.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace liquidblend::client {

// "" if the error has none, as errors that no server has answered.
std::string ReasonOf(const absl::Status& status);

// Nothing if the status is OK.
void SetReason(const std::string& reason, absl::Status& status);

}  // namespace liquidblend::client
