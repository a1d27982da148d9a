#include "server/base/status_details.h"

#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "google/rpc/error_details.pb.h"
#include "server/base/errors.h"

namespace liquidblend::server {
namespace {

constexpr size_t kMaxMessage = 1000;
constexpr absl::Duration kRetryDelay = absl::Seconds(1);  // if nobody knows better

absl::Status Completed(const absl::Status& status) {
  absl::Status complete = WithMetadata(status, {});
  if (absl::IsUnavailable(status) && !status.GetPayload(kRetryInfoUrl).has_value()) {
    return WithRetryDelay(std::move(complete), kRetryDelay);
  }
  return complete;
}

}  // namespace

google::rpc::Status ToStatusDetails(const absl::Status& status) {
  const absl::Status told = Completed(status);
  google::rpc::Status details;
  details.set_code(static_cast<int>(told.code()));
  details.set_message(CleanText(told.message(), kMaxMessage));
  for (const char* url : {kBadRequestUrl, kErrorInfoUrl, kQuotaFailureUrl, kRetryInfoUrl}) {
    const absl::optional<absl::Cord> payload = told.GetPayload(url);
    if (!payload.has_value()) continue;
    google::protobuf::Any* detail = details.add_details();
    detail->set_type_url(url);
    detail->set_value(std::string(*payload));
  }
  return details;
}

absl::Duration RetryDelay(const absl::Status& status) {
  google::rpc::RetryInfo info;
  const absl::optional<absl::Cord> payload = status.GetPayload(kRetryInfoUrl);
  if (payload.has_value()) info.ParseFromString(std::string(*payload));
  return absl::Seconds(info.retry_delay().seconds()) +
         absl::Nanoseconds(info.retry_delay().nanos());
}

}  // namespace liquidblend::server
