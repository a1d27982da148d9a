#include "core/trace/context.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace liquidblend::trace {
namespace {

constexpr char kGood[] = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

TEST(ParseContext, ReadsWhatItWrites) {
  const SpanContext context = ParseContext(kGood, "vendor=1,other=2");
  EXPECT_TRUE(context.is_valid());
  EXPECT_EQ(context.trace_high, 0x4bf92f3577b34da6);
  EXPECT_EQ(context.trace_low, 0xa3ce929d0e0e4736);
  EXPECT_EQ(context.span_id, 0x00f067aa0ba902b7);
  EXPECT_TRUE(context.is_sampled);
  EXPECT_EQ(context.state, "vendor=1,other=2");
  EXPECT_EQ(ToTraceparent(context), kGood);
  EXPECT_EQ(TraceIdOf(context), "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(SpanIdOf(context), "00f067aa0ba902b7");
}

TEST(ParseContext, TheLowestFlagIsThatOfSampling) {
  const std::string begin = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-";
  for (const auto& [flags, is_sampled] :
       {std::pair("00", false), {"01", true}, {"02", false}, {"03", true}, {"ff", true}}) {
    const SpanContext context = ParseContext(begin + flags);
    EXPECT_TRUE(context.is_valid()) << flags;
    EXPECT_EQ(context.is_sampled, is_sampled) << flags;
    EXPECT_EQ(ToTraceparent(context), begin + (is_sampled ? "01" : "00"));
  }
}

TEST(ParseContext, LaterVersionsMayGoOn) {
  const std::string fields = "4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  EXPECT_TRUE(ParseContext("01-" + fields).is_valid());
  EXPECT_TRUE(ParseContext("cc-" + fields + "-what-the-future-will-be-like").is_valid());
  EXPECT_FALSE(ParseContext("cc-" + fields + ".what-the-future-will-be-like").is_valid());
  EXPECT_FALSE(ParseContext("00-" + fields + "-more").is_valid());
  EXPECT_FALSE(ParseContext("ff-" + fields).is_valid());
}

TEST(ParseContext, RefusesAllElse) {
  for (const std::string text :
       {"", "00", "00-", "x", "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-0",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-011",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-0x",
        "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
        "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e473g-00f067aa0ba902b7-01",
        "00_4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736_00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7_01",
        "0g-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        " 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01,"
        "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"}) {
    const SpanContext context = ParseContext(text, "vendor=1");
    EXPECT_FALSE(context.is_valid()) << text;
    EXPECT_EQ(context.state, "") << text;
    EXPECT_EQ(ToTraceparent(context), "");
    EXPECT_EQ(TraceIdOf(context), "");
    EXPECT_EQ(SpanIdOf(context), "");
  }
}

TEST(ParseContext, LeavesOutAStateThatIsTooLongOrNotPrintable) {
  EXPECT_EQ(ParseContext(kGood, std::string(512, 'a')).state, std::string(512, 'a'));
  for (const std::string& state : {std::string(513, 'a'), std::string("a\nb"), std::string("\xFF"),
                                   std::string("a\0b", 3), std::string("\x7F")}) {
    const SpanContext context = ParseContext(kGood, state);
    EXPECT_TRUE(context.is_valid());
    EXPECT_EQ(context.state, "");
  }
}

TEST(RandomId, IsNeverTheSame) {
  std::set<uint64_t> ids = {0};
  for (int k = 0; k < 1000; ++k) EXPECT_TRUE(ids.insert(RandomId()).second);
}

}  // namespace
}  // namespace liquidblend::trace
