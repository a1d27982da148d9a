// What calls make of exceptions, and of stores that refuse the server.
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "server/rpc/errors.h"

namespace liquidblend::rpc {

// kPermissionDenied that says nothing of the request (no google.rpc details) is that of a store
// which refuses the server, not the client: kUnavailable.
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

// FromServer(work()), which returns absl::Status or absl::StatusOr; what it throws becomes
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

}  // namespace liquidblend::rpc
