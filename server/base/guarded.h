// Conversion of exceptions, and of refusals by the stores, into the status of a call.
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "server/base/errors.h"

namespace liquidblend::server {

// Turns kPermissionDenied without google.rpc details, by which a store refuses the server and not
// the client, into kUnavailable.
inline absl::Status FromServer(absl::Status status) {
  const bool is_of_request =
      status.GetPayload(kErrorInfoUrl).has_value() || status.GetPayload(kBadRequestUrl).has_value();
  if (!absl::IsPermissionDenied(status) || is_of_request) return status;
  return absl::UnavailableError(status.message());
}
template <typename Value>
absl::StatusOr<Value> FromServer(absl::StatusOr<Value> result) {
  if (result.ok()) return result;
  return FromServer(result.status());
}

// Returns FromServer(work()), an absl::Status or absl::StatusOr; exceptions become
// kResourceExhausted (out of memory) or kInternal.
template <typename Work>
auto Guarded(Work&& work) -> decltype(work()) {
  try {
    return FromServer(work());
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the server is out of memory");
  } catch (const std::exception& error) {
    return absl::InternalError(absl::StrCat("unexpected: ", error.what()));
  }
}

// Runs work() on a thread that must survive: exceptions are logged under `name`. This is the last
// resort, since a call whose work ends here is not answered.
template <typename Work>
void RunGuarded(const char* name, Work&& work) noexcept {
  try {
    const absl::Status status = Guarded([&] {
      work();
      return absl::OkStatus();
    });
    if (!status.ok()) base::LogError(absl::StrCat(name, " failed: ", status.ToString()));
  } catch (...) {  // not even memory for the message
  }
}

}  // namespace liquidblend::server
