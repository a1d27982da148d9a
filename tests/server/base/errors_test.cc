#include "server/base/errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using testing::EndsWith;
using testing::Pair;
using testing::SizeIs;
using testing::UnorderedElementsAre;

TEST(CleanText, KeepsTextAndReplacesWhatIsNone) {
  EXPECT_EQ(CleanText("w\xC3\xA4ter \xE2\x82\xAC \xF0\x9F\x92\xA7"),
            "w\xC3\xA4ter \xE2\x82\xAC \xF0\x9F\x92\xA7");
  EXPECT_EQ(CleanText("a\nb\x7F\x01"), "a?b??");
  EXPECT_EQ(CleanText("\xFF\xC3(\xE2\x82"),
            "?"
            "?(?"
            "?");
  EXPECT_EQ(CleanText("\xC0\xAF"), "??") << "overlong";
  EXPECT_EQ(CleanText("\xED\xA0\x80"), "???") << "half of a surrogate pair";
  EXPECT_EQ(CleanText("\xF4\x90\x80\x80"), "????") << "past the last character";
}

TEST(CleanText, CutsBetweenCharacters) {
  EXPECT_EQ(CleanText("ab\xC3\xA4", 3), "ab");
  EXPECT_EQ(CleanText("ab\xC3\xA4", 4), "ab\xC3\xA4");
}

TEST(FieldViolations, AreToldUpToANumberThatFitsIntoHeaders) {
  FieldViolations violations;
  for (int k = 0; k < 1000; ++k) {
    violations.Add(absl::StrCat("targets[", k, "]"), std::string(1000, 'x'));
  }
  const absl::Status status = violations.ToStatus();
  EXPECT_THAT(BlamedFields(status), SizeIs(kMaxViolations));
  EXPECT_THAT(std::string(status.message()), EndsWith("; and 992 more"));
  EXPECT_LT(status.GetPayload(kBadRequestUrl)->size(), 3000U);
}

TEST(WithMetadata, AddsToTheReasonThatThereIs) {
  const absl::Status full =
      WithReason(absl::ResourceExhaustedError("full"), "TOO_MANY_FILES", {{"limit", "4"}});
  const absl::Status told = WithMetadata(full, {{"resource", "animations/a"}, {"limit", "no"}});
  EXPECT_EQ(ReasonOf(told), "TOO_MANY_FILES");
  EXPECT_THAT(PayloadOf<google::rpc::ErrorInfo>(told, kErrorInfoUrl).metadata(),
              UnorderedElementsAre(Pair("limit", "4"), Pair("resource", "animations/a")));
  EXPECT_EQ(ReasonOf(WithMetadata(absl::NotFoundError("none"), {})), "NOT_FOUND");
  EXPECT_TRUE(WithMetadata(absl::OkStatus(), {{"a", "b"}}).ok());
}

TEST(WithRetryDelay, KeepsFractionsOfSeconds) {
  const absl::Status status =
      WithRetryDelay(absl::UnavailableError("later"), absl::Milliseconds(1250));
  EXPECT_EQ(RetryDelayOf(status), absl::Milliseconds(1250));
}

}  // namespace
}  // namespace liquidblend::server
