#include "server/frames/query_weights.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/store/files/parameter_records.h"
#include "server/api/handlers.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using testing::HasSubstr;

using Code = absl::StatusCode;
using Point = std::vector<std::pair<std::string, double>>;

const char kErrorInfo[] = "type.googleapis.com/google.rpc.ErrorInfo";

template <typename Request>
void SetPoint(const Point& point, Request& request) {
  request.clear_parameters();
  for (const auto& [name, value] : point) {
    v1::Parameter& parameter = *request.add_parameters();
    parameter.set_name(name);
    parameter.set_value(value);
  }
}

// Four animations.
mesh::RegisteredFamily FourAnimations() {
  const synthetic::TargetFields still = {synthetic::SmoothWarp(1, 0.0F, 0.0F), {}};
  return synthetic::MakeFamily(synthetic::MixedSphere(1), {still, still, still});
}

// They are at the corners of a rectangle.
catalog::LoadedFamily Corners(mesh::Interpolation interpolation) {
  mesh::RegisteredFamily family = FourAnimations();
  family.name = "corners";
  family.parameter_space = {
      {"width", "height"}, {{0.5, 20}, {1, 20}, {0.5, 60}, {1, 60}}, interpolation};
  parameters::Interpolator space = *parameters::Interpolator::Make(family.parameter_space);
  return catalog::LoadedFamily(std::move(family), std::move(space));
}

absl::StatusOr<FrameQuery> Ask(const v1::GetFrameRequest& request,
                               mesh::Interpolation interpolation = mesh::Interpolation::kLinear) {
  FrameQuery query;
  const AskedBlend asked = {request.weights(), request.parameters(), request.extrapolate()};
  const absl::Status status = SetWeights(Corners(interpolation), asked, query);
  if (!status.ok()) return status;
  return query;
}

absl::StatusOr<FrameQuery> AskAt(const Point& point, bool extrapolate = false) {
  v1::GetFrameRequest request;
  SetPoint(point, request);
  request.set_extrapolate(extrapolate);
  return Ask(request);
}

TEST(SetWeights, ParametersAreTakenByNameInAnyOrder) {
  const auto query = AskAt({{"height", 30}, {"width", 0.875}});
  ASSERT_THAT(query, Succeeds());
  EXPECT_THAT(query->weights, ElementsAre(0.5, 0.0, 0.25));
  EXPECT_FALSE(query->is_extrapolated);
}

TEST(SetWeights, APointOutsideOfTheHullIsRefusedUnlessExtrapolated) {
  const auto refused = AskAt({{"width", 1.25}, {"height", 40}});
  EXPECT_THAT(refused, Fails(Code::kOutOfRange, "the nearest point of it is (width 1, height 40)"));
  EXPECT_THAT(BlamedFields(refused.status()), ElementsAre("parameters"));
  EXPECT_TRUE(refused.status().GetPayload(kErrorInfo).has_value());
  const auto query = AskAt({{"width", 1.25}, {"height", 40}}, true);
  ASSERT_THAT(query, Succeeds());
  EXPECT_THAT(query->weights, ElementsAre(1.0, 0.0, 0.5));
  EXPECT_TRUE(query->is_extrapolated);
}

TEST(SetWeights, WeightsThatLeaveAPartNoTimeToFallAreClamped) {
  mesh::RegisteredFamily family = FourAnimations();
  family.targets[0].report.part_lives = {{{0, 0, 1}, 10, 20}};
  const catalog::LoadedFamily loaded(std::move(family), {});
  const auto ask = [&](double weight) {
    v1::GetFrameRequest request;
    for (size_t k = 0; k < loaded.family.targets.size(); ++k) request.add_weights(0.0);
    request.set_weights(0, weight);
    FrameQuery query;
    EXPECT_THAT(SetWeights(loaded, {request.weights(), request.parameters()}, query), Succeeds());
    return query;
  };
  EXPECT_FALSE(ask(-0.75).is_clamped);
  const FrameQuery clamped = ask(-0.875);
  EXPECT_TRUE(clamped.is_clamped);
  EXPECT_NEAR(clamped.weights[0], -0.8, 1e-9);
  EXPECT_FALSE(ask(-0.5).is_clamped) << "the query is reused";
}

TEST(SetWeights, ExtrapolationEndsAtTheLimitsOfWeights) {
  const auto far = AskAt({{"width", 2.0}, {"height", 20}}, true);
  EXPECT_THAT(far, Fails(Code::kOutOfRange, "are too far outside of the hull"));
  EXPECT_THAT(BlamedFields(far.status()), ElementsAre("parameters"));
}

TEST(SetWeights, SmoothInterpolationBlendsAllAnimations) {
  const auto ask = [](const Point& point, bool extrapolate) {
    v1::GetFrameRequest request;
    SetPoint(point, request);
    request.set_extrapolate(extrapolate);
    return Ask(request, mesh::Interpolation::kSmooth);
  };
  const auto middle = ask({{"width", 0.75}, {"height", 40}}, false);
  ASSERT_THAT(middle, Succeeds());
  EXPECT_THAT(middle->weights, ElementsAre(0.25, 0.25, 0.25));
  EXPECT_FALSE(middle->is_extrapolated);
  EXPECT_THAT(ask({{"width", 1.25}, {"height", 40}}, false),
              Fails(Code::kOutOfRange, "the nearest point of it is (width 1, height 40)"));
  EXPECT_TRUE(ask({{"width", 1.25}, {"height", 40}}, true)->is_extrapolated);
  EXPECT_THAT(ask({{"width", 2.5}, {"height", 20}}, true),
              Fails(Code::kOutOfRange, "are too far outside of the hull"));
}

TEST(SetWeights, EveryMistakeIsToldByName) {
  const auto fails = [](const Point& point, const char* what) {
    const auto query = AskAt(point);
    EXPECT_THAT(query, Fails(Code::kInvalidArgument, what));
    EXPECT_THAT(BlamedFields(query.status()), ElementsAre("parameters"));
  };
  fails({{"width", 1}}, "height is missing; there are width, height");
  fails({{"width", 1}, {"depth", 1}}, "'depth' is not a parameter of the family (width, height)");
  fails({{"width", 1}, {"width", 1}}, "width is given twice");
  fails({{"width", 1}, {"height", std::nan("")}}, "height is nan");
  v1::GetFrameRequest both;
  SetPoint({{"width", 1}, {"height", 20}}, both);
  both.add_weights(1);
  EXPECT_THAT(Ask(both), Fails(Code::kInvalidArgument, "parameters: exclude weights"));
}

class ParametersTest : public RpcTest {
 protected:
  ParametersTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {
    ImportAnimation("a");
    ImportAnimation("b");
    PublishFamily("drops", "a", "b", 1, {{"height"}, {{1}, {3}}});
  }

  absl::StatusOr<v1::Frame> FrameAt(double height, bool extrapolate = false) {
    v1::GetFrameRequest request;
    request.set_family("families/drops");
    request.set_time_s(0.1);
    SetPoint({{"height", height}}, request);
    request.set_extrapolate(extrapolate);
    return GetFrame(backends_, request);
  }

  static v1::RegisterFamilyRequest Registration(const std::vector<double>& heights) {
    v1::RegisterFamilyRequest request;
    request.set_family_id("drops");
    request.set_source("animations/a");
    request.add_targets("animations/b");
    request.mutable_parameter_space()->add_names("height");
    for (const double height : heights) {
      request.mutable_parameter_space()->add_points()->add_values(height);
    }
    return request;
  }

  Backends backends_;
};

TEST_F(ParametersTest, AFrameIsTheSameBytesAsByItsWeights) {
  const auto by_parameters = FrameAt(1.5);
  ASSERT_THAT(by_parameters, Succeeds());
  EXPECT_THAT(by_parameters->weights(), ElementsAre(0.25));
  EXPECT_FALSE(by_parameters->extrapolated());
  v1::GetFrameRequest request;
  request.set_family("families/drops");
  request.set_time_s(0.1);
  request.add_weights(0.25);
  const auto by_weights = GetFrame(backends_, request);
  ASSERT_THAT(by_weights, Succeeds());
  EXPECT_EQ(by_parameters->data(), by_weights->data());
}

TEST_F(ParametersTest, AFrameTellsThatItIsExtrapolated) {
  EXPECT_THAT(FrameAt(4), Fails(Code::kOutOfRange, "parameters: (height 4) lies outside"));
  const auto frame = FrameAt(4, true);
  ASSERT_THAT(frame, Succeeds());
  EXPECT_THAT(frame->weights(), ElementsAre(1.5));
  EXPECT_TRUE(frame->extrapolated());
}

TEST(MakeFrame, TellsThatItsWeightsAreClamped) {
  const catalog::LoadedFamily loaded(FourAnimations(), {});
  FrameQuery query;
  query.weights = {0, 0, 0};
  FrameBuffers buffers;
  EXPECT_FALSE(MakeFrame(loaded, query, buffers)->clamped());
  query.is_clamped = true;
  EXPECT_TRUE(MakeFrame(loaded, query, buffers)->clamped());
}

TEST_F(ParametersTest, AFamilyTellsThePoints) {
  v1::GetFamilyRequest request;
  request.set_name("families/drops");
  const auto family = GetFamily(backends_, request);
  ASSERT_THAT(family, Succeeds());
  EXPECT_THAT(family->parameter_space().names(), ElementsAre("height"));
  ASSERT_EQ(family->parameter_space().points_size(), 2);
  EXPECT_THAT(family->parameter_space().points(1).values(), ElementsAre(3));
}

TEST_F(ParametersTest, AFamilyWithoutPointsIsAskedByWeightsOnly) {
  PublishFamily("drops", "a", "b");
  EXPECT_THAT(FrameAt(2), Fails(Code::kFailedPrecondition, "family drops was registered without"));
  v1::GetFamilyRequest request;
  request.set_name("families/drops");
  EXPECT_FALSE(GetFamily(backends_, request)->has_parameter_space());
}

// Such a family cannot be registered; a file of it is one that was damaged.
TEST_F(ParametersTest, AFamilyWhosePointsMakeNoHullIsLostData) {
  PublishFamily("drops", "a", "b", 2, {{"height"}, {{1}, {1}}});
  EXPECT_THAT(FrameAt(1), Fails(Code::kDataLoss, "height is 1 for all animations"));
}

TEST_F(ParametersTest, PointsReachTheJob) {
  v1::RegisterFamilyRequest request = Registration({20, 60});
  request.set_replace(true);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  const store::pb::ParameterSpace space = TakeJob().job.register_family().parameter_space();
  EXPECT_THAT(space.names(), ElementsAre("height"));
  ASSERT_EQ(space.points_size(), 2);
  EXPECT_THAT(space.points(0).values(), ElementsAre(20));
}

TEST_F(ParametersTest, PointsThatMakeNoHullAreRefused) {
  const auto refused = RegisterFamily(backends_, Registration({20, 20}));
  EXPECT_THAT(refused, Fails(Code::kInvalidArgument, "height is 20 for all animations"));
  EXPECT_THAT(BlamedFields(refused.status()), ElementsAre("parameter_space"));
  EXPECT_THAT(RegisterFamily(backends_, Registration({20})),
              Fails(Code::kInvalidArgument, "1 points for 2 animations"));
  v1::RegisterFamilyRequest empty = Registration({});
  empty.mutable_parameter_space()->clear_names();
  EXPECT_THAT(RegisterFamily(backends_, empty),
              Fails(Code::kInvalidArgument, "has neither names nor points"));
  v1::RegisterFamilyRequest flat = Registration({20, 60});
  flat.mutable_parameter_space()->add_names("width");
  for (auto& point : *flat.mutable_parameter_space()->mutable_points()) {
    point.add_values(point.values(0));
  }
  EXPECT_THAT(RegisterFamily(backends_, flat),
              Fails(Code::kInvalidArgument, "need at least 3 animations, got 2"));
}

TEST_F(ParametersTest, ARefinementKeepsThePointsUnlessThereAreNewOnes) {
  v1::RegisterFamilyRequest request;
  request.set_family_id("drops");
  request.set_refine(true);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  EXPECT_THAT(TakeJob().job.register_family().parameter_space().points(1).values(), ElementsAre(3));
}

// Three animations at heights 1, 2 and 3.
class InterpolationTest : public ParametersTest {
 protected:
  InterpolationTest() { ImportAnimation("c"); }

  static v1::RegisterFamilyRequest Registration(v1::ParameterSpace::Interpolation interpolation) {
    v1::RegisterFamilyRequest request = ParametersTest::Registration({1, 2, 3});
    request.set_family_id("three");
    request.add_targets("animations/c");
    request.mutable_parameter_space()->set_interpolation(interpolation);
    return request;
  }

  // Registers, publishes a family without vertices, and tells what its interpolation is.
  v1::ParameterSpace::Interpolation Published(const v1::RegisterFamilyRequest& request) {
    EXPECT_THAT(RegisterFamily(backends_, request), Succeeds());
    for (int target = 0; target < 2; ++target) {  // each is a child
      EXPECT_THAT(catalog_->FinishChild(TakeJob().lease_id, "blob"), Succeeds());
    }
    const auto leased = TakeJob();
    const store::pb::RegisterJob& job = leased.job.register_family();
    store::pb::FamilyRecord record;
    record.set_id("three");
    record.set_blob("blob");
    record.mutable_manifest()->set_source(job.source());
    *record.mutable_manifest()->mutable_targets() = job.targets();
    *record.mutable_manifest()->mutable_parameter_space() =
        store::ToMessage(store::FromMessage(job.parameter_space()));  // as the worker does
    EXPECT_THAT(catalog_->PublishFamily(leased.lease_id, record), Succeeds());
    v1::GetFamilyRequest get;
    get.set_name("families/three");
    const auto family = GetFamily(backends_, get);
    EXPECT_EQ(family->parameter_space().points_size(), 3);
    return family->parameter_space().interpolation();
  }

  static v1::RegisterFamilyRequest Refinement() {
    v1::RegisterFamilyRequest request;
    request.set_family_id("three");
    request.set_refine(true);
    return request;
  }
};

TEST_F(InterpolationTest, IsLinearUnlessItIsAskedForAndKeptByRefinements) {
  using Space = v1::ParameterSpace;
  EXPECT_EQ(Published(Registration(Space::INTERPOLATION_UNSPECIFIED)), Space::LINEAR);
  EXPECT_EQ(Published(Refinement()), Space::LINEAR);
  v1::RegisterFamilyRequest request = Refinement();
  request.mutable_parameter_space()->set_interpolation(Space::SMOOTH);
  EXPECT_EQ(Published(request), Space::SMOOTH);
  EXPECT_EQ(Published(Refinement()), Space::SMOOTH);
  v1::RegisterFamilyRequest moved = Registration(Space::INTERPOLATION_UNSPECIFIED);
  moved.set_refine(true);
  EXPECT_EQ(Published(moved), Space::SMOOTH);
  request.mutable_parameter_space()->set_interpolation(Space::LINEAR);
  EXPECT_EQ(Published(request), Space::LINEAR);
  v1::RegisterFamilyRequest replaced = Registration(Space::SMOOTH);
  replaced.set_replace(true);
  EXPECT_EQ(Published(replaced), Space::SMOOTH);
}

TEST_F(InterpolationTest, ThatCannotBeMeantIsRefused) {
  const auto refused = [&](const v1::RegisterFamilyRequest& request, const char* what) {
    const absl::Status status = RegisterFamily(backends_, request).status();
    EXPECT_THAT(status, Fails(Code::kInvalidArgument, what));
    EXPECT_THAT(BlamedFields(status), ElementsAre("parameter_space"));
  };
  v1::RegisterFamilyRequest request = ParametersTest::Registration({1, 3});
  request.mutable_parameter_space()->set_interpolation(v1::ParameterSpace::SMOOTH);
  refused(request, "smooth interpolation of 1 parameter needs at least 3 animations, got 2");
  request = Registration(v1::ParameterSpace::SMOOTH);
  request.mutable_parameter_space()->clear_names();
  request.mutable_parameter_space()->clear_points();
  refused(request, "smooth interpolation needs a point for each animation");
  refused(Registration(static_cast<v1::ParameterSpace::Interpolation>(7)),
          "interpolation 7 is neither linear nor smooth");
  PublishFamily("drops", "a", "b");  // without points
  request = Refinement();
  request.set_family_id("drops");
  request.mutable_parameter_space()->set_interpolation(v1::ParameterSpace::SMOOTH);
  refused(request, "smooth interpolation needs a point for each animation");
}

TEST_F(ParametersTest, ARefinementCanMoveThePoints) {
  v1::RegisterFamilyRequest request = Registration({20, 60});
  request.set_refine(true);
  ASSERT_THAT(RegisterFamily(backends_, request), Succeeds());
  EXPECT_THAT(TakeJob().job.register_family().parameter_space().points(1).values(),
              ElementsAre(60));
}

TEST_F(ParametersTest, AStreamChangesParametersAndWeightsForOneAnother) {
  SimpleStream stream(families_);
  v1::StreamFramesRequest request;
  request.set_family("families/drops");
  request.set_lossless(true);
  SetPoint({{"height", 2}}, request);
  const auto next = [&] {
    EXPECT_THAT(stream.Change(request), Succeeds());
    const auto response = stream.MakeNext();
    EXPECT_THAT(response, Succeeds());
    request.Clear();
    return response->frame();
  };
  EXPECT_THAT(next().weights(), ElementsAre(0.5));
  request.add_weights(0.125);
  EXPECT_THAT(next().weights(), ElementsAre(0.125));
  SetPoint({{"height", 2.5}}, request);
  EXPECT_THAT(next().weights(), ElementsAre(0.75));
  request.set_rate(1);  // and nothing of the blend
  EXPECT_THAT(next().weights(), ElementsAre(0.75));
  request.set_extrapolate(true);
  SetPoint({{"height", 4}}, request);
  EXPECT_TRUE(next().extrapolated());
  request.set_extrapolate(false);
  EXPECT_THAT(stream.Change(request), Fails(Code::kOutOfRange, "outside of the hull"));
}

}  // namespace
}  // namespace liquidblend::server
