#include "client/cli/flags/clean_text.h"

#include <gtest/gtest.h>

#include <string>

namespace liquidblend::cli {
namespace {

TEST(CleanText, KeepsTextAndReplacesWhatATerminalObeys) {
  EXPECT_EQ(CleanText("w\xC3\xA4ter \xE2\x82\xAC \xF0\x9F\x92\xA7\n two"),
            "w\xC3\xA4ter \xE2\x82\xAC \xF0\x9F\x92\xA7\n two");
  EXPECT_EQ(CleanText("\x1B]52;c;aGk=\x07\x1B[2K\r\t\x7F"), "?]52;c;aGk=?\?[2K???");
  EXPECT_EQ(CleanText(std::string("a\0b", 3)), "a?b");
  EXPECT_EQ(CleanText("\xC2\x9B"
                      "2K\xC2\x80\xC2\x9F\xC2\xA0"),
            "?2K??\xC2\xA0")
      << "C1 as UTF-8";
  EXPECT_EQ(CleanText("\x9B"
                      "2K"),
            "?2K")
      << "C1 as a byte";
}

TEST(CleanText, ReplacesWhatReordersAndBreaksLines) {
  EXPECT_EQ(CleanText("a\xE2\x80\xAE"
                      "b\xE2\x80\xA8"
                      "c\xE2\x81\xA6"
                      "d\xD8\x9C"),
            "a?b?c?d?");
}

TEST(CleanText, ReplacesBytesThatAreNoUtf8) {
  EXPECT_EQ(CleanText("\xFF\xC3(\xE2\x82"), "?\?(??");
  EXPECT_EQ(CleanText("\xC0\x9B"), "??") << "overlong";
  EXPECT_EQ(CleanText("\xE0\x82\x9B"), "???") << "overlong";
  EXPECT_EQ(CleanText("\xED\xA0\x80"), "???") << "half of a surrogate pair";
  EXPECT_EQ(CleanText("\xF4\x90\x80\x80"), "????") << "past the last character";
}

TEST(CleanLine, HasNoNewlines) {
  EXPECT_EQ(CleanLine("a\nfamilies/drops: version 7"), "a?families/drops: version 7");
}

TEST(EscapeJson, EscapesWhatMayStandInStringsAsItIs) {
  EXPECT_EQ(EscapeJson("{\n  \"a\": \"\\\\\x7F\xC2\x9B\xC3\xA4\xE2\x82\xAC\"\n}"),
            "{\n  \"a\": \"\\\\\\u007f\\u009b\xC3\xA4\xE2\x82\xAC\"\n}");
}

}  // namespace
}  // namespace liquidblend::cli
