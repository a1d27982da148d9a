#include "server/base/lazy_text.h"

#include <gtest/gtest.h>

#include <new>
#include <string>
#include <thread>
#include <vector>

namespace liquidblend::server {
namespace {

TEST(LazyText, IsMadeOnceForAll) {
  const LazyText text;
  int num_made = 0;
  {
    std::vector<std::jthread> readers;
    for (int k = 0; k < 8; ++k) {
      readers.emplace_back([&] {
        const std::string& seen = text.Of([&] {
          ++num_made;
          return std::string("text");
        });
        EXPECT_EQ(seen, "text");
      });
    }
  }
  EXPECT_EQ(num_made, 1);
}

TEST(LazyText, IsMadeLaterIfThereWasNoMemory) {
  const LazyText text;
  EXPECT_THROW(text.Of([]() -> std::string { throw std::bad_alloc(); }), std::bad_alloc);
  EXPECT_EQ(text.Of([] { return std::string("text"); }), "text");
}

}  // namespace
}  // namespace liquidblend::server
