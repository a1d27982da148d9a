// Lists that come page by page. Internal to client/.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {

inline constexpr int kPageSize = 250;  // servers.cc bounds the bytes of a page

// What a list may have at most; a longer one is that of a server that lies.
struct ListLimits {
  int num_pages = 40'000;  // ten million items
  int64_t num_bytes = int64_t{1} << 30;
};

// Sets the request's page size, and calls fetch(request) for each page, which returns a StatusOr of
// it, and take(item) for each item of items(page), which may refuse it.
// Errors: theirs; kDataLoss if a page has more items than its size, or the list does not end: a
// page names itself as the next one, or the limits are passed.
template <typename Request, typename Fetch, typename Items, typename Take>
absl::Status ForEachItem(Request request, const Fetch& fetch, const Items& items, const Take& take,
                         const ListLimits& limits = {}) {
  request.set_page_size(kPageSize);
  int64_t num_bytes = 0;
  for (int k = 0; k < limits.num_pages && num_bytes <= limits.num_bytes; ++k) {
    LBC_ASSIGN_OR_RETURN(const auto page, fetch(request));
    if (items(page).size() > kPageSize) {
      return absl::DataLossError("the server's list has more items on a page than were asked for");
    }
    for (const auto& item : items(page)) LBC_RETURN_IF_ERROR(take(item));
    if (page.next_page_token().empty()) return absl::OkStatus();
    if (page.next_page_token() == request.page_token()) break;
    num_bytes += static_cast<int64_t>(page.ByteSizeLong());
    request.set_page_token(page.next_page_token());
  }
  return absl::DataLossError("the server's list does not end");
}

}  // namespace liquidblend::client
