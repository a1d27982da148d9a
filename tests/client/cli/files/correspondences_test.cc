#include "client/cli/files/correspondences.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/client/temp_files.h"

namespace liquidblend::cli {
namespace {

using ::testing::HasSubstr;

absl::StatusOr<std::vector<std::vector<Correspondence>>> Read(const std::string& text) {
  const testing::TempDir dir;
  return ReadCorrespondences(dir.Write("c.json", text));
}

TEST(Correspondences, ReadsTheDocumentedFile) {
  const auto lists = Read(R"({"correspondences": [
    [{"kind": "trajectory", "hard": true, "length_s": 0.5,
      "source": {"position": [1, 2.5, -3], "time_s": 0.25},
      "target": {"position": [4, 5, 6], "time_s": 0.75}},
     {"source": {"position": [0, 0, 0], "time_s": 0}, "target": {"position": [0, 0, 0], "time_s": 1}}],
    [] ]})");
  ASSERT_TRUE(lists.ok()) << lists.status();
  ASSERT_EQ(lists->size(), 2u);
  ASSERT_EQ((*lists)[0].size(), 2u);
  EXPECT_TRUE((*lists)[1].empty());
  const Correspondence& first = (*lists)[0][0];
  EXPECT_EQ(first.kind, CorrespondenceKind::kTrajectory);
  EXPECT_TRUE(first.hard);
  EXPECT_EQ(first.length_s, 0.5);
  EXPECT_EQ(first.source.position.y, 2.5);
  EXPECT_EQ(first.target.time_s, 0.75);
  EXPECT_EQ((*lists)[0][1].kind, CorrespondenceKind::kPoint);
  EXPECT_FALSE((*lists)[0][1].hard);
}

TEST(Correspondences, WhatIsWrittenIsReadAsItWas) {
  Family family;
  family.reports.resize(2);
  CorrespondenceReport entry;
  entry.correspondence.kind = CorrespondenceKind::kSpace;
  entry.correspondence.source = {{0.1, -2e-9, 3}, 1.0 / 3};
  entry.correspondence.target.time_s = 0.7;
  entry.correspondence.length_s = 0.25;
  family.reports[1].correspondences = {entry, entry};
  const auto lists = Read(FormatCorrespondences(family));
  ASSERT_TRUE(lists.ok()) << lists.status();
  ASSERT_EQ(lists->size(), 2u);
  EXPECT_TRUE((*lists)[0].empty());
  ASSERT_EQ((*lists)[1].size(), 2u);
  const Correspondence& read = (*lists)[1][1];
  EXPECT_EQ(read.kind, CorrespondenceKind::kSpace);
  EXPECT_EQ(read.source.position.x, 0.1);
  EXPECT_EQ(read.source.position.y, -2e-9);
  EXPECT_EQ(read.source.time_s, 1.0 / 3);
  EXPECT_EQ(read.target.time_s, 0.7);
  EXPECT_EQ(read.length_s, 0.25);
}

TEST(Correspondences, NamesThePlaceOfEveryMistake) {
  const std::string event = R"({"position": [0, 0, 0], "time_s": 0})";
  const auto refusal = [&](const std::string& entry) {
    return Read("{\"correspondences\": [[" + entry + "]]}").status().ToString();
  };
  EXPECT_THAT(Read("{").status().ToString(), HasSubstr("c.json: is not JSON"));
  EXPECT_THAT(Read("[]").status().ToString(), HasSubstr("is not an object"));
  EXPECT_THAT(Read("{\"correspondences\": [7]}").status().ToString(),
              HasSubstr("correspondences[0]: is not a list"));
  EXPECT_THAT(refusal("7"), HasSubstr("correspondences[0][0]: is not an object"));
  EXPECT_THAT(refusal("{\"sauce\": 1}"), HasSubstr("unknown key \"sauce\""));
  EXPECT_THAT(refusal("{\"kind\": \"line\", \"source\": " + event + ", \"target\": " + event + "}"),
              HasSubstr("[0][0].kind: \"line\""));
  EXPECT_THAT(refusal("{\"source\": " + event + "}"), HasSubstr("[0][0].target: is missing"));
  EXPECT_THAT(refusal("{\"hard\": 1}"), HasSubstr("[0][0].hard"));
  EXPECT_THAT(refusal(R"({"source": {"position": [0, 0], "time_s": 0}})"),
              HasSubstr("[0][0].source.position"));
  EXPECT_THAT(refusal(R"({"source": {"position": [0, 0, "z"], "time_s": 0}})"),
              HasSubstr("source.position[2]: is not a number"));
  EXPECT_THAT(refusal(R"({"source": {"position": [0, 0, 0]}})"), HasSubstr("source.time_s"));
}

}  // namespace
}  // namespace liquidblend::cli
