#include "worker/jobs/attempt/run_guarded.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <limits>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include "core/base/data_limit.h"
#include "core/base/retry.h"
#include "tests/allocation_testing.h"

namespace liquidblend::jobs {
namespace {

constexpr int64_t kMebibyte = 1 << 20;
constexpr int64_t kGibibyte = 1 << 30;

TEST(MemoryAllowance, IsGenerousButNeverMoreThanTheWorkerMayHold) {
  EXPECT_EQ(MemoryAllowance({0, 8 * kGibibyte}), 8 * kGibibyte);
  EXPECT_EQ(MemoryAllowance({100 * kMebibyte, 8 * kGibibyte}), 400 * kMebibyte + kGibibyte);
  EXPECT_EQ(MemoryAllowance({7 * kGibibyte, 8 * kGibibyte}), 8 * kGibibyte);
  EXPECT_EQ(MemoryAllowance({100 * kMebibyte, kGibibyte}), kGibibyte);
  constexpr int64_t kAny = std::numeric_limits<int64_t>::max();
  EXPECT_EQ(MemoryAllowance({0, kAny}), kAny);
  EXPECT_EQ(MemoryAllowance({kAny / 5, kAny}), kAny / 5 * 4 + kGibibyte);
  EXPECT_EQ(MemoryAllowance({kAny, kAny}), kAny);
}

TEST(Guarded, TurnsWhatIsThrownIntoAStatus) {
  EXPECT_EQ(Guarded("x", [] { return absl::NotFoundError("y"); }), absl::NotFoundError("y"));
  EXPECT_TRUE(
      base::IsOverMemoryLimit(Guarded("x", []() -> absl::Status { throw std::bad_alloc(); })));
  EXPECT_EQ(Guarded("x", []() -> absl::Status { throw std::runtime_error("y"); }),
            absl::InternalError("x: y"));
  EXPECT_TRUE(absl::IsUnavailable(Guarded(
      "x", []() -> absl::Status { throw std::system_error(EMFILE, std::generic_category()); })));
}

absl::Status AllocateMebibytes(int64_t mebibytes) {
  const std::vector<char> memory(static_cast<size_t>(mebibytes * kMebibyte));
  return memory.empty() ? absl::InternalError("nothing allocated") : absl::OkStatus();
}

TEST(RunWithinMemory, NamesTheStageTheLimitAndTheEstimate) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  std::string stage = "opening files";
  const JobMemory memory = {20 * kMebibyte, 128 * kMebibyte};
  const absl::Status status = RunWithinMemory(
      memory, [&] { return stage; },
      [&] {
        stage = "reading frames";
        return AllocateMebibytes(200);
      });
  EXPECT_TRUE(base::IsOverMemoryLimit(status));
  EXPECT_EQ(status.message(),
            "out of memory in stage 'reading frames': the job may allocate 128 MiB on this worker; "
            "the estimate is 20 MiB");
  EXPECT_EQ(AllocateMebibytes(200), absl::OkStatus()) << "the limit goes with the job";
  EXPECT_EQ(RunWithinMemory(
                memory, [&] { return stage; }, [] { return AllocateMebibytes(100); }),
            absl::OkStatus());
}

// A thread's stack is memory, too.
TEST(RunWithinMemory, AThreadThatDoesNotFitIsOverTheLimit) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  const absl::Status status = RunWithinMemory(
      {0, kMebibyte}, [] { return "a stage"; },
      [] {
        std::thread([] {}).join();
        return absl::OkStatus();
      });
  EXPECT_TRUE(base::IsOverMemoryLimit(status)) << status;
}

// Holds nearly all that may be allocated while the stage fails.
absl::Status FailCloseToTheLimit(const JobMemory& memory, const absl::Status& error) {
  std::vector<char> held;
  return RunWithinMemory(
      memory, [] { return "storing"; },
      [&] {
        held.resize(static_cast<size_t>(memory.worker_bytes - 8 * kMebibyte));
        return error;
      });
}

// It may be that a store was away at that moment, so another attempt is worth it; but only one.
TEST(RunWithinMemory, ATransientErrorCloseToTheLimitIsOfTheEnvironmentTheFirstTime) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  JobMemory memory = {0, 128 * kMebibyte};
  const absl::Status away = absl::UnavailableError("S3 is away");
  const absl::Status first = FailCloseToTheLimit(memory, away);
  EXPECT_TRUE(base::IsTransient(first)) << first;
  EXPECT_EQ(first.message(), "S3 is away (close to the memory that the job may allocate)");
  EXPECT_TRUE(WasCloseToLimit(first.message()));
  EXPECT_FALSE(WasCloseToLimit(away.message()));
  memory.was_close = true;
  const absl::Status second = FailCloseToTheLimit(memory, away);
  EXPECT_TRUE(base::IsOverMemoryLimit(second)) << second;
  const absl::Status refused = absl::PermissionDeniedError("HTTP status 403");
  EXPECT_EQ(FailCloseToTheLimit(memory, refused), refused) << "memory has no part in that";
  const absl::Status bad = absl::InvalidArgumentError("bad input");
  EXPECT_EQ(FailCloseToTheLimit(memory, bad), bad);
}

TEST(RunWithinMemory, MissingThreadsWithMemoryLeftAreOfTheEnvironment) {
  const absl::Status status = RunWithinMemory(
      {0, 128 * kMebibyte}, [] { return "a stage"; },
      []() -> absl::Status { throw std::system_error(EAGAIN, std::generic_category()); });
  EXPECT_TRUE(absl::IsUnavailable(status)) << status;
}

}  // namespace
}  // namespace liquidblend::jobs
