#include "core/base/retry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/base/data_limit.h"
#include "core/base/posix_file.h"

namespace liquidblend::base {
namespace {

using Code = absl::StatusCode;

TEST(IsTransient, KnowsFailuresThatSayNothingOfTheJob) {
  for (const Code code : {Code::kUnavailable, Code::kResourceExhausted, Code::kPermissionDenied}) {
    EXPECT_TRUE(IsTransient(absl::Status(code, ""))) << absl::StatusCodeToString(code);
  }
  for (const Code code : {Code::kOk, Code::kInternal, Code::kDataLoss, Code::kNotFound,
                          Code::kInvalidArgument, Code::kAborted}) {
    EXPECT_FALSE(IsTransient(absl::Status(code, ""))) << absl::StatusCodeToString(code);
  }
}

TEST(IsTransient, IsALackOfFilesThreadsAndAddresses) {
  for (const int error_number : {EMFILE, ENFILE, ENOMEM, EAGAIN, ENOSPC}) {
    EXPECT_TRUE(IsTransient(ErrnoStatus(error_number, "map", "/data/blob"))) << error_number;
  }
}

TEST(IsTransient, IsNotWhatAJobNeedsTooMuchOf) {
  EXPECT_TRUE(IsTransient(absl::UnavailableError("S3 is away")));
  EXPECT_TRUE(IsTransient(absl::ResourceExhaustedError("disk full")));
  EXPECT_FALSE(IsTransient(MemoryLimitError("out of memory")));
  EXPECT_FALSE(IsTransient(absl::InternalError("no")));
}

TEST(ExponentialPause, DoublesUpToTheLongest) {
  const absl::Duration first = absl::Milliseconds(100);
  const absl::Duration longest = absl::Seconds(1);
  EXPECT_EQ(ExponentialPause(1, first, longest), first);
  EXPECT_EQ(ExponentialPause(2, first, longest), 2 * first);
  EXPECT_EQ(ExponentialPause(4, first, longest), 8 * first);
  EXPECT_EQ(ExponentialPause(5, first, longest), longest);
  EXPECT_EQ(ExponentialPause(2'000'000'000, first, longest), longest);
  EXPECT_EQ(ExponentialPause(2'000'000'000, absl::ZeroDuration(), longest), absl::ZeroDuration());
}

TEST(Jittered, DiffersByTheShareAtMost) {
  const absl::Duration pause = absl::Seconds(4);
  EXPECT_EQ(Jittered(pause, 0.25, 0.0), absl::Seconds(3));
  EXPECT_EQ(Jittered(pause, 0.25, 0.5), pause);
  EXPECT_EQ(Jittered(pause, 0.0, 0.0), pause);
  absl::Duration least = pause;
  absl::Duration most = pause;
  for (int k = 0; k < 100; ++k) {
    const absl::Duration jittered = Jittered(pause, 0.25);
    EXPECT_GE(jittered, absl::Seconds(3));
    EXPECT_LE(jittered, absl::Seconds(5));
    least = std::min(least, jittered);
    most = std::max(most, jittered);
  }
  EXPECT_LT(least, most);
}

}  // namespace
}  // namespace liquidblend::base
