#include "client/src/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "google/rpc/error_details.pb.h"

namespace liquidblend::client {
namespace {

using ::testing::HasSubstr;

// Of two animations and one parameter.
v1::Family SampleFamily() {
  v1::Family family;
  family.set_name("drops");
  family.set_version(1);
  family.set_source("a");
  family.add_targets("b");
  family.mutable_parameter_space()->add_names("height");
  for (const double height : {1.0, 3.0}) {
    family.mutable_parameter_space()->add_points()->add_values(height);
  }
  return family;
}

std::string ErrorOf(const v1::Family& family) {
  const absl::StatusOr<Family> read = FromProto(family);
  EXPECT_TRUE(absl::IsDataLoss(read.status())) << read.status();
  return std::string(read.status().message());
}

TEST(FamilyFromProto, HasAPointOfEachAnimation) {
  const absl::StatusOr<Family> family = FromProto(SampleFamily());
  ASSERT_TRUE(family.ok()) << family.status();
  ASSERT_EQ(family->parameter_space.points.size(), 2);
  EXPECT_EQ(family->parameter_space.points[1][0], 3.0);
}

// Callers index points and values without looking at their number, in C without knowing it.
TEST(FamilyFromProto, RefusesPointsThatDoNotFit) {
  v1::Family family = SampleFamily();
  for (int k = 0; k < 1000; ++k) family.add_targets("more");
  EXPECT_THAT(ErrorOf(family), HasSubstr("'drops' has 2 points, and its animations are 1002"));
  family = SampleFamily();
  family.mutable_parameter_space()->clear_points();
  EXPECT_THAT(ErrorOf(family), HasSubstr("0 points"));
  family = SampleFamily();
  family.mutable_parameter_space()->clear_names();
  EXPECT_THAT(ErrorOf(family), HasSubstr("1 values at a point, and its parameters are 0"));
  family = SampleFamily();
  family.mutable_parameter_space()->mutable_points(1)->add_values(4.0);
  EXPECT_THAT(ErrorOf(family), HasSubstr("2 values at a point, and its parameters are 1"));
}

// Loops over frames end at the duration.
TEST(FamilyFromProto, RefusesDurationsAndRatesThatAreNone) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double value : {std::nan(""), kInfinity, -1.0}) {
    v1::Family family = SampleFamily();
    family.set_duration_s(value);
    EXPECT_THAT(ErrorOf(family), HasSubstr("about drops has a duration of"));
    family = SampleFamily();
    family.set_frames_per_second(value);
    EXPECT_THAT(ErrorOf(family), HasSubstr("a frame rate of"));
    v1::Animation animation;
    animation.set_frames_per_second(value);
    EXPECT_TRUE(absl::IsDataLoss(FromProto(animation).status()));
  }
}

// protobuf's JSON writer calls itself for each.
TEST(FamilyFromProto, LeavesDetailsOutThatHoldOthersWithoutEnd) {
  google::protobuf::Any detail;
  for (int k = 0; k < 20'000; ++k) {
    google::protobuf::Any outer;
    outer.set_type_url("type.googleapis.com/google.protobuf.Any");
    outer.set_value(detail.SerializeAsString());
    detail = std::move(outer);
  }
  v1::Family family = SampleFamily();
  google::rpc::Status& error = *family.mutable_failed_registration()->mutable_error();
  error.set_code(9);
  *error.add_details() = detail;
  google::rpc::ErrorInfo info;
  info.set_reason("TOO_LARGE");
  error.add_details()->PackFrom(info);
  const absl::StatusOr<Family> read = FromProto(family);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->json, HasSubstr("TOO_LARGE"));
  EXPECT_LT(read->json.size(), 1000);
  v1::Animation animation;
  *animation.mutable_error() = error;
  EXPECT_THAT(FromProto(animation)->json, HasSubstr("TOO_LARGE"));
}

TEST(OperationFromProto, RefusesAFamilyWhosePointsDoNotFit) {
  google::longrunning::Operation operation;
  operation.set_name("operations/1");
  operation.set_done(true);
  operation.mutable_response()->PackFrom(SampleFamily());
  ASSERT_TRUE(FromProto(operation).ok());
  v1::Family family = SampleFamily();
  family.add_targets("one more");
  operation.mutable_response()->PackFrom(family);
  EXPECT_TRUE(absl::IsDataLoss(FromProto(operation).status()));
}

}  // namespace
}  // namespace liquidblend::client
