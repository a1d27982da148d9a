#include "client/src/reason.h"

#include "absl/strings/cord.h"

namespace liquidblend::client {
namespace {

constexpr char kReasonUrl[] = "liquidblend/reason";

}  // namespace

std::string ReasonOf(const absl::Status& status) {
  const absl::optional<absl::Cord> reason = status.GetPayload(kReasonUrl);
  return reason.has_value() ? std::string(*reason) : "";
}

void SetReason(const std::string& reason, absl::Status& status) {
  if (!reason.empty()) status.SetPayload(kReasonUrl, absl::Cord(reason));
}

}  // namespace liquidblend::client
