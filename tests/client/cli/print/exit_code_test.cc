#include "client/cli/print/exit_code.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace liquidblend::cli {
namespace {

TEST(StatusOfException, TellsThatMemoryIsShortAndElseWhatWasThrown) {
  const absl::Status no_memory = StatusOfException(std::bad_alloc());
  EXPECT_TRUE(absl::IsResourceExhausted(no_memory));
  EXPECT_EQ(no_memory.message(), "this machine has not enough memory for that");
  EXPECT_EQ(ToExitCode(no_memory), kExitFailed);
  const absl::Status other = StatusOfException(std::length_error("too long"));
  EXPECT_TRUE(absl::IsInternal(other));
  EXPECT_EQ(other.message(), "an unexpected error: too long");
  EXPECT_EQ(ToExitCode(other), kExitFailed);
}

}  // namespace
}  // namespace liquidblend::cli
