// Wherever memory runs out, locks and permits are given back.
#include <gtest/gtest.h>

#include <new>
#include <string>

#include "server/access/quotas.h"
#include "tests/failing_new.h"

namespace liquidblend::server {
namespace {

using testing_memory::FailingOnce;

TEST(QuotasOutOfMemory, AStreamThatCannotBeTakenDoesNotCount) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  bool has_failed = true;
  for (int n = 0; has_failed; ++n) {
    Quotas quotas;
    Principal viewer;
    viewer.name = viewer.key = std::string(100, 'a');
    viewer.limits.max_streams = 1;
    absl::StatusOr<StreamPermit> permit = absl::UnknownError("");
    {
      const FailingOnce failing(n);
      try {
        permit = quotas.TakeStream(viewer);
      } catch (const std::bad_alloc&) {
      }
      has_failed = FailingOnce::has_failed();
    }
    EXPECT_EQ(permit.ok(), !has_failed) << n;
    EXPECT_EQ(quotas.TakeStream(viewer).ok(), has_failed) << n;
  }
}

}  // namespace
}  // namespace liquidblend::server
