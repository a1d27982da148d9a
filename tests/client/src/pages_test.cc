#include "client/src/pages.h"

#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::client {
namespace {

// How many items come of a list of `num_pages`, each with as many bytes, until it is left.
int NumTaken(int num_pages, size_t num_bytes, const ListLimits& limits, absl::Status& status) {
  int next = 0;
  const auto fetch = [&](const v1::ListAnimationsRequest& request) {
    EXPECT_EQ(request.page_token(), next == 0 ? "" : absl::StrCat(next));
    v1::ListAnimationsResponse page;
    page.add_animations()->set_name(std::string(num_bytes, 'a'));
    if (++next < num_pages) page.set_next_page_token(absl::StrCat(next));
    return absl::StatusOr<v1::ListAnimationsResponse>(page);
  };
  const auto items = [](const auto& page) -> auto& { return page.animations(); };
  int num_taken = 0;
  const auto take = [&](const v1::Animation&) {
    ++num_taken;
    return absl::OkStatus();
  };
  status = ForEachItem(v1::ListAnimationsRequest(), fetch, items, take, limits);
  return num_taken;
}

TEST(ForEachItem, TakesListsUpToItsLimits) {
  absl::Status status;
  const ListLimits limits = {.num_pages = 10, .num_bytes = 1'000'000};
  EXPECT_EQ(NumTaken(10, 1, limits, status), 10);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(NumTaken(11, 1, limits, status), 10);
  EXPECT_EQ(status, absl::DataLossError("the server's list does not end"));
  EXPECT_EQ(NumTaken(5, 200'000, limits, status), 5);
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(NumTaken(10, 400'000, limits, status), 3);
  EXPECT_EQ(status, absl::DataLossError("the server's list does not end"));
}

}  // namespace
}  // namespace liquidblend::client
