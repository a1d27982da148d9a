#include "worker/jobs/required_grade.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "google/rpc/error_details.pb.h"

namespace liquidblend::jobs {
namespace {

using mesh::Grade;
using testing::HasSubstr;

RegisteredTarget Target(const std::string& name, Grade grade) {
  RegisteredTarget target;
  target.name = name;
  target.registration.report.verdict.grade = grade;
  target.registration.report.verdict.reason = "because";
  return target;
}

std::string ReasonOf(const absl::Status& status) {
  google::rpc::ErrorInfo info;
  const auto payload = status.GetPayload("type.googleapis.com/google.rpc.ErrorInfo");
  if (payload) info.ParseFromString(std::string(*payload));
  return info.reason();
}

TEST(CheckGrades, AcceptsWhatIsAtLeastAsGood) {
  const std::vector targets = {Target("b", Grade::kGood), Target("c", Grade::kDoubtful)};
  EXPECT_TRUE(CheckGrades(targets, store::v1::DOUBTFUL).ok());
  const absl::Status status = CheckGrades(targets, store::v1::GOOD);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(status), "VERDICT_TOO_LOW");
  EXPECT_THAT(std::string(status.message()), HasSubstr("target 'c': the verdict is doubtful"));
}

TEST(CheckGrades, AnUnknownGradeIsTooLow) {
  const std::vector targets = {Target("b", Grade::kGood), Target("old", Grade::kUnknown)};
  for (const auto required : {store::v1::GOOD, store::v1::DOUBTFUL}) {
    const absl::Status status = CheckGrades(targets, required);
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(ReasonOf(status), "VERDICT_TOO_LOW");
    EXPECT_THAT(std::string(status.message()), HasSubstr("target 'old' has no verdict"));
  }
  EXPECT_TRUE(CheckGrades(targets, store::v1::GRADE_UNSPECIFIED).ok());
}

}  // namespace
}  // namespace liquidblend::jobs
