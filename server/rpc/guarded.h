// Where the server catches what others throw.
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/log.h"

namespace liquidblend::rpc {

// work(), which returns absl::Status or absl::StatusOr; what it throws becomes kResourceExhausted
// (out of memory) or kInternal.
template <typename Work>
auto Guarded(Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError("the server is out of memory");
  } catch (const std::exception& error) {
    return absl::InternalError(absl::StrCat("unexpected: ", error.what()));
  }
}

// Runs work() on behalf of a thread that must go on whatever happens: exceptions are logged under
// `name`. The last line of defence: a call whose work ends here is not answered.
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

}  // namespace liquidblend::rpc
