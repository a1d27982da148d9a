// Wherever memory runs out, locks are given back.
#include <gtest/gtest.h>

#include <new>
#include <string>

#include "server/base/operation_looks.h"
#include "tests/failing_new.h"

namespace liquidblend::server {
namespace {

using testing_memory::FailingOnce;

TEST(OperationLooksOutOfMemory, ALookThatCannotBeMadeLeavesNothing) {
  LB_SKIP_UNLESS_ALLOCATIONS_MAY_FAIL();
  WorkPool timers(1, 10), lookers(1, 10);
  OperationLooks looks(lookers, timers, absl::Seconds(1));
  const std::string name = "operations/" + std::string(100, 'a');
  const OperationLooks::Read read = []() -> absl::StatusOr<google::longrunning::Operation> {
    return absl::UnavailableError("nobody asks");
  };
  bool has_failed = true;
  for (int n = 0; has_failed; ++n) {
    std::shared_ptr<OperationLook> look;
    {
      const FailingOnce failing(n);
      try {
        look = looks.Of(name, read);
      } catch (const std::bad_alloc&) {
      }
      has_failed = FailingOnce::has_failed();
    }
    EXPECT_EQ(look == nullptr, has_failed) << n;
    EXPECT_EQ(looks.num_looks(), has_failed ? 0 : 1) << n;
    look = looks.Of(name, read);
    EXPECT_EQ(looks.Of(name, read), look) << n;
  }
}

}  // namespace
}  // namespace liquidblend::server
