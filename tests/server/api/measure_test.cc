// MeasureCorrespondences.
#include "server/frames/measure.h"

#include <atomic>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "server/api/handlers.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server::measure_test {
namespace {

class MeasureTest : public RpcTest {
 protected:
  MeasureTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {}
  ~MeasureTest() override { backends_.Stop(); }

  void SetUp() override { PublishSplash(); }

  // Where a vertex of the source's surface is at the end of its life in the source's first half,
  // and where the registration puts it.
  v1::Correspondence Exact() {
    const auto loaded = families_.Get("splash");
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    const mesh::RegisteredFamily& family = (*loaded)->family;
    size_t v = 0;
    while (!(family.vertices[v][3] > 1 && family.vertices[v][3] < 6)) ++v;
    const mesh::Float4& from = family.vertices[v];
    const mesh::Float4& by = family.targets[0].displacement[v];
    v1::Correspondence pair;
    pair.set_kind(v1::Correspondence::POINT);
    const auto set = [&](v1::Event& event, float share) {
      event.mutable_position()->set_x(from[0] + share * by[0]);
      event.mutable_position()->set_y(from[1] + share * by[1]);
      event.mutable_position()->set_z(from[2] + share * by[2]);
      event.set_time_s((from[3] + share * by[3]) / family.frames_per_second);
    };
    set(*pair.mutable_source(), 0);
    set(*pair.mutable_target(), 1);
    return pair;
  }

  absl::StatusOr<v1::MeasureCorrespondencesResponse> Measure(
      const v1::MeasureCorrespondencesRequest& request, IsWanted is_wanted = [] { return true; }) {
    absl::StatusOr<v1::MeasureCorrespondencesResponse> response;
    absl::Notification is_done;
    MeasureCorrespondences(backends_, request, Caller(), std::move(is_wanted),
                           [&](absl::StatusOr<v1::MeasureCorrespondencesResponse> measured) {
                             response = std::move(measured);
                             is_done.Notify();
                           });
    is_done.WaitForNotification();
    return response;
  }

  absl::StatusOr<v1::MeasureCorrespondencesResponse> MeasureOf(const v1::Correspondence& pair) {
    v1::MeasureCorrespondencesRequest request;
    request.set_family("families/splash");
    *request.add_correspondences() = pair;
    return Measure(request);
  }

  // Request for as many slices as one may ask for.
  v1::MeasureCorrespondencesRequest LongRequest() {
    v1::MeasureCorrespondencesRequest request;
    request.set_family("splash");
    v1::Correspondence pair = Exact();
    pair.set_kind(v1::Correspondence::SPACE);
    pair.mutable_source()->set_time_s(0);
    for (int k = 0; k < kMaxMeasured; ++k) *request.add_correspondences() = pair;
    return request;
  }

  Backends backends_;
};

// Far below a mean edge of 0.1 m: the surface at a vertex is that vertex.
constexpr double kOnSurface = 0.01;

TEST_F(MeasureTest, WhatTheRegistrationDoesHasNoResidual) {
  const auto measured = MeasureOf(Exact());
  ASSERT_TRUE(measured.ok()) << measured.status();
  ASSERT_EQ(measured->residuals_size(), 1);
  const auto& residual = measured->residuals(0);
  EXPECT_LT(residual.residual_m(), kOnSurface);
  EXPECT_LT(residual.residual_frames(), 0.1);
  EXPECT_LT(residual.source_distance_m(), kOnSurface);
  EXPECT_LT(residual.target_distance_m(), kOnSurface);
}

TEST_F(MeasureTest, WhatIsOffIsOffByThat) {
  v1::Correspondence pair = Exact();
  v1::Vector3& place = *pair.mutable_target()->mutable_position();
  place.set_x(place.x() + 3);
  const auto space = MeasureOf(pair);
  ASSERT_TRUE(space.ok());
  EXPECT_NEAR(space->residuals(0).residual_m(), 3, 2 * kOnSurface);
  EXPECT_GT(space->residuals(0).target_distance_m(), 1);
  pair = Exact();
  pair.mutable_target()->set_time_s(pair.target().time_s() + 1.0 / 24);
  const auto time = MeasureOf(pair);
  EXPECT_NEAR(time->residuals(0).residual_frames(), 1, 0.1);
  EXPECT_NEAR(time->residuals(0).residual_edges(), 1, 0.2) << "a frame counts as an edge";
  pair.set_kind(v1::Correspondence::SPACE);
  pair.set_length_s(1.0 / 24);
  EXPECT_EQ(MeasureOf(pair)->residuals(0).residual_frames(), 0);
}

TEST_F(MeasureTest, ChangesNothing) {
  const auto before = catalog_->GetFamily("splash");
  ASSERT_TRUE(MeasureOf(Exact()).ok());
  EXPECT_EQ(catalog_->GetFamily("splash")->SerializeAsString(), before->SerializeAsString());
}

TEST_F(MeasureTest, MistakesAreNamed) {
  const auto blamed = [](const absl::Status& status) {
    const auto fields = BlamedFields(status);
    return fields.empty() ? "" : fields[0];
  };
  v1::Correspondence pair = Exact();
  pair.mutable_source()->set_time_s(99);
  EXPECT_EQ(blamed(MeasureOf(pair).status()), "correspondences[0].source.time_s");
  pair = Exact();
  pair.mutable_target()->mutable_position()->set_y(std::nan(""));
  EXPECT_EQ(blamed(MeasureOf(pair).status()), "correspondences[0].target.position");
  pair = Exact();
  pair.set_length_s(-1);
  EXPECT_EQ(blamed(MeasureOf(pair).status()), "correspondences[0].length_s");
  v1::MeasureCorrespondencesRequest request;
  request.set_family("splash");
  EXPECT_EQ(blamed(Measure(request).status()), "correspondences");
  for (int k = 0; k <= kMaxMeasured; ++k) *request.add_correspondences() = Exact();
  EXPECT_EQ(blamed(Measure(request).status()), "correspondences");
  request.clear_correspondences();
  *request.add_correspondences() = Exact();
  request.set_target_index(1);
  EXPECT_EQ(blamed(Measure(request).status()), "target_index");
  request.set_family("none");
  EXPECT_TRUE(absl::IsNotFound(Measure(request).status()));
}

TEST_F(MeasureTest, EndsAtTheNextSliceWhenNobodyWantsItAnyMore) {
  std::atomic<int> num_asked = 0;
  const auto measured = Measure(LongRequest(), [&] { return ++num_asked <= 3; });
  EXPECT_TRUE(absl::IsCancelled(measured.status())) << measured.status();
  EXPECT_EQ(num_asked, 4);
}

TEST_F(MeasureTest, OthersHaveTheirTurnsBetweenItsSlices) {
  absl::Notification other_transfer;
  int num_asked = 0, num_asked_before_other = 0;
  const auto measured = Measure(LongRequest(), [&] {
    if (++num_asked > 1) return true;
    FrameWork work;
    work.client = "other";
    work.run = [&] { num_asked_before_other = num_asked; };
    EXPECT_TRUE(backends_.frames.Post(std::move(work), true).ok());
    // Task for the only thread of transfers.
    EXPECT_TRUE(backends_.transfers.Post([&] { other_transfer.Notify(); }).ok());
    EXPECT_TRUE(other_transfer.WaitForNotificationWithTimeout(absl::Seconds(20)));
    return true;
  });
  ASSERT_TRUE(measured.ok()) << measured.status();
  EXPECT_EQ(measured->residuals_size(), kMaxMeasured);
  EXPECT_GT(num_asked, 2 * kMaxMeasured);
  EXPECT_GE(num_asked_before_other, 1);
  EXPECT_LE(num_asked_before_other, 2);
}

TEST_F(MeasureTest, AFamilysSpaceComesWithItsSimplices) {
  PublishFamily("waves", "a", "b", 1, {{"h"}, {{0.0}, {1.0}}});
  v1::GetFamilyRequest request;
  request.set_name("waves");
  const auto family = GetFamily(backends_, request);
  ASSERT_TRUE(family.ok()) << family.status();
  ASSERT_EQ(family->parameter_space().simplices_size(), 1);
  EXPECT_THAT(family->parameter_space().simplices(0).animations(), testing::ElementsAre(0, 1));
}

}  // namespace
}  // namespace liquidblend::server::measure_test
