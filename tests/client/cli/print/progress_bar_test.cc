#include "client/cli/print/progress_bar.h"

#include <gtest/gtest.h>

namespace liquidblend::cli {
namespace {

TEST(ProgressBar, ShowsTheShareAndFitsTheTerminal) {
  EXPECT_EQ(ProgressBar::FormatBar(0.5, "half", 80), "[############............]  50 %  half");
  EXPECT_EQ(ProgressBar::FormatBar(7.0, "", 80).substr(0, 26), "[########################]");
  EXPECT_EQ(ProgressBar::FormatBar(0.0, std::string(200, 'x'), 40).size(), 39u);
}

TEST(ProgressBar, PrintsALineWhenTheStepChangesAndNotOftener) {
  ::testing::internal::CaptureStderr();
  {
    ProgressBar bar(ProgressBar::Style::kLines);
    bar.Update(0.1, "one", "one, 10 %");
    bar.Update(0.2, "one", "one, 20 %");
    bar.Update(0.3, "two", "two, 30 %");
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "one, 10 %\ntwo, 30 %\n");
}

TEST(ProgressBar, ATextOfTheServerStaysInItsLineAndHasNoControlCharacters) {
  for (const auto style : {ProgressBar::Style::kLines, ProgressBar::Style::kBar}) {
    ::testing::internal::CaptureStderr();
    {
      ProgressBar bar(style);
      bar.Update(0.1, "one", "a\x1B[2K\r\nb\xC2\x9B");
    }
    const std::string drawn = ::testing::internal::GetCapturedStderr();
    EXPECT_NE(drawn.find("a?[2K??b?\n"), std::string::npos) << drawn;
  }
}

TEST(ProgressBar, IsSilentWhenQuiet) {
  ::testing::internal::CaptureStderr();
  ProgressBar bar(ProgressBar::ChooseStyle(/*quiet=*/true));
  bar.Update(0.1, "one", "one");
  bar.Finish();
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(ProgressBar, EndsTheLineOfABarWithTheNewestText) {
  ::testing::internal::CaptureStderr();
  {
    ProgressBar bar(ProgressBar::Style::kBar);
    bar.Update(0.1, "one", "first");
    bar.Update(0.9, "one", "last");
  }
  const std::string drawn = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(drawn.find("90 %  last\n"), std::string::npos) << drawn;
}

TEST(Format, TimesAndSizesAreShort) {
  EXPECT_EQ(FormatTimeLeft(0.0), "unknown");
  EXPECT_EQ(FormatTimeLeft(64.2), "1:05");
  EXPECT_EQ(FormatTimeLeft(3671), "1:01:11");
  EXPECT_EQ(FormatBytes(999), "999 B");
  EXPECT_EQ(FormatBytes(12345678), "12.3 MB");
}

}  // namespace
}  // namespace liquidblend::cli
