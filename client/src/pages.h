// Lists that come page by page. Internal to client/.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {

// A longer list is that of a server that lies: it has ten million items.
inline constexpr int kMaxPages = 10'000;
inline constexpr int64_t kMaxListBytes = int64_t{1} << 30;

// Calls fetch(request) for each page and take(page) with it, which may refuse it.
// Errors: theirs; kDataLoss if the list does not end: a page names itself as the next one, or there
// are more than kMaxPages pages or kMaxListBytes of messages.
template <typename Request, typename Fetch, typename Take>
absl::Status ForEachPage(Request request, const Fetch& fetch, const Take& take) {
  int64_t num_bytes = 0;
  for (int k = 0; k < kMaxPages && num_bytes <= kMaxListBytes; ++k) {
    auto page = fetch(request);
    LBC_RETURN_IF_ERROR(page.status());
    LBC_RETURN_IF_ERROR(take(*page));
    if (page->next_page_token().empty()) return absl::OkStatus();
    if (page->next_page_token() == request.page_token()) break;
    num_bytes += static_cast<int64_t>(page->ByteSizeLong());
    request.set_page_token(page->next_page_token());
  }
  return absl::DataLossError("the server's list does not end");
}

}  // namespace liquidblend::client
