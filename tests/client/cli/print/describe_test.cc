#include "client/cli/print/describe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace liquidblend::cli {
namespace {

Animation MakeAnimation(const std::string& word, AnimationState state) {
  Animation animation;
  animation.name = word;
  animation.state = state;
  animation.notes = {word, word};
  if (state == AnimationState::kFailed) animation.error = absl::InvalidArgumentError(word);
  return animation;
}

FailedRegistration MakeFailed(const std::string& word) {
  FailedRegistration failed;
  failed.operation = word;
  failed.error = absl::InternalError(word);
  return failed;
}

Family MakeFamily(const std::string& word) {
  Family family;
  family.name = family.source = word;
  family.targets = {word, word};
  family.failed_registration = MakeFailed(word);
  family.parameter_space.names = {word};
  family.parameter_space.points = {{1.0}, {2.0}, {3.0}};
  family.time_blending.reason = word;
  FamilyVersion& kept = family.kept_versions.emplace_back();
  kept.source = word;
  kept.targets = {word, word};
  family.space_time_reports.emplace_back().animation = word;
  RegistrationReport& report = family.reports.emplace_back();
  report.target = word;
  report.hypotheses.emplace_back().pairing = word;
  report.verdict.grade = Grade::kDoubtful;
  report.verdict.reason = word;
  return family;
}

Operation MakeOperation(const std::string& word) {
  Operation operation;
  operation.name = operation.subject = word;
  operation.progress.stage = operation.progress.waiting_for = operation.progress.worker = word;
  operation.progress.attempt = 2;
  operation.progress.last_failure = absl::InternalError(word);
  return operation;
}

// Everything that is said of objects whose words are all `word`.
std::string DescribeAll(const std::string& word) {
  std::string text;
  for (const AnimationState state : {AnimationState::kReady, AnimationState::kFailed}) {
    const Animation animation = MakeAnimation(word, state);
    text += Describe(animation) + Summarize(animation);
  }
  Family family = MakeFamily(word);
  for (const int64_t version : {0, 1}) {
    family.version = version;
    text += Describe(family) + Summarize(family);
  }
  family.failed_registration.reset();
  family.version = 0;
  text += Describe(family) + Summarize(family);
  Operation operation = MakeOperation(word);
  text += Summarize(operation);
  operation.done = true;
  operation.result = absl::InternalError(word);
  return text + Summarize(operation);
}

TEST(Describe, WordsOfTheServerAddNoLines) {
  const std::string plain = DescribeAll("w.d");
  const std::string hostile = DescribeAll("w\nd");
  std::string expected = plain;
  for (size_t at = 0; (at = expected.find("w.d", at)) != std::string::npos;) expected[at + 1] = '?';
  EXPECT_EQ(hostile, expected);
  EXPECT_GT(std::count(expected.begin(), expected.end(), '?'), 40);
}

}  // namespace
}  // namespace liquidblend::cli
