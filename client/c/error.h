// Errors of the C API: codes, and a text and a reason for each thread.
#pragma once

#include <exception>
#include <string>

#include "absl/status/status.h"
#include "liquidblend/liquidblend.h"

namespace liquidblend::c_api {

// Keeps the message for lb_last_error() and the reason for lb_last_error_reason(), and returns the
// code.
lb_status Report(const absl::Status& status);

// The error of an argument.
absl::Status InvalidArgument(const char* argument, const char* what);

// Checks that an argument is not null.
inline absl::Status CheckIsThere(const void* argument, const char* name) {
  return argument == nullptr ? InvalidArgument(name, "is NULL") : absl::OkStatus();
}

// Calls `body`, which returns an absl::Status, and reports that. An exception, as when there is no
// memory, becomes LB_RESOURCE_EXHAUSTED or LB_INTERNAL.
template <typename Body>
lb_status Guarded(const Body& body) noexcept {
  try {
    return Report(body());
  } catch (const std::bad_alloc&) {
    return Report(absl::ResourceExhaustedError("out of memory"));
  } catch (const std::exception& error) {
    return Report(absl::InternalError(error.what()));
  } catch (...) {
    return Report(absl::InternalError("an unknown exception"));
  }
}

// Gives the handle that `make` returns as a StatusOr of a unique_ptr. On an error `out` is null.
template <typename Handle, typename Make>
lb_status Give(Handle** out, const Make& make) noexcept {
  if (out == nullptr) return Report(InvalidArgument("out", "is NULL"));
  *out = nullptr;
  return Guarded([&]() -> absl::Status {
    auto made = make();
    if (!made.ok()) return made.status();
    *out = made->release();
    return absl::OkStatus();
  });
}

}  // namespace liquidblend::c_api
