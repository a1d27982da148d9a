#include "core/base/glob.h"

#include <gtest/gtest.h>

#include <string>

namespace liquidblend::base {
namespace {

TEST(MatchesGlob, TakesWholeNames) {
  for (const char* pattern : {"liquid.*", "*", "*.ply", "l*d.0?01.*", "liquid.0001.ply", "**.ply",
                              "[a-l]*", "[!m-z]*", "liquid.[0-9][0-9]01.ply", "*[]y]"}) {
    EXPECT_TRUE(MatchesGlob(pattern, "liquid.0001.ply")) << pattern;
  }
  for (const char* pattern : {"", "liquid", "foam.*", "*.PLY", "liquid.?.ply", "[m-z]*", "[!l]*",
                              "liquid.0001.ply?", "*.ply.*", "[liquid"}) {
    EXPECT_FALSE(MatchesGlob(pattern, "liquid.0001.ply")) << pattern;
  }
  EXPECT_TRUE(MatchesGlob("", ""));
  EXPECT_TRUE(MatchesGlob("*", ""));
  EXPECT_FALSE(MatchesGlob("?", ""));
  EXPECT_TRUE(MatchesGlob("a[", "a["));
  EXPECT_TRUE(MatchesGlob("a[-9]b", "a-b"));
}

// By trying each star again for each of the others it would take years.
TEST(MatchesGlob, TakesNoLongerForManyStars) {
  std::string pattern;
  for (int k = 0; k < 64; ++k) pattern += "*a";
  EXPECT_FALSE(MatchesGlob(pattern + "b", std::string(255, 'a')));
}

}  // namespace
}  // namespace liquidblend::base
