#include "server/api/check_animations.h"

#include "absl/strings/str_cat.h"
#include "server/api/handlers.h"
#include "tests/server/api/handlers_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using store::pb::AnimationManifest;

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;

class CheckAnimationsTest : public HandlersTest {
 protected:
  // Registers "a" to a "b" that is changed.
  absl::Status RegisterTo(const std::function<void(AnimationManifest&)>& change) {
    ImportAnimation("a");
    AnimationManifest manifest = SmallManifest();
    change(manifest);
    ImportAnimation("b", manifest);
    return RegisterFamily(backends_, Registration()).status();
  }
};

TEST_F(CheckAnimationsTest, AnotherFrameRateIsRefusedWithBoth) {
  EXPECT_THAT(RegisterTo([](auto& b) { b.set_frames_per_second(25); }),
              Fails(kInvalid,
                    "targets[0]: animation 'b' has 25 frames per second, but the source 'a' has "
                    "24; both must have the same: import one of them again with its true rate"));
}

TEST_F(CheckAnimationsTest, TheRateOfFilmOnVideoCountsAsFilms) {
  EXPECT_THAT(RegisterTo([](auto& b) { b.set_frames_per_second(23.976); }), Succeeds());
}

TEST_F(CheckAnimationsTest, AnotherUpIsRefusedWithBoth) {
  const auto with_up = [&](const std::string& id, store::pb::Up up) {
    AnimationManifest manifest = SmallManifest();
    manifest.set_up(up);
    ImportAnimation(id, manifest);
  };
  const auto registered = [&](const std::string& source, const std::string& target) {
    v1::RegisterFamilyRequest request = Registration();
    request.set_family_id(absl::StrCat(source, "-", target));
    request.set_source("animations/" + source);
    request.set_targets(0, "animations/" + target);
    return RegisterFamily(backends_, request).status();
  };
  with_up("y1", store::pb::UP_Y);
  with_up("y2", store::pb::UP_Y);
  with_up("down", store::pb::UP_MINUS_Z);
  with_up("assumed", store::pb::UP_UNSPECIFIED);
  with_up("z", store::pb::UP_Z);
  EXPECT_THAT(
      registered("y1", "down"),
      Fails(kInvalid, "targets[0]: animation 'down' has -z up, but the source 'y1' has y up"));
  EXPECT_THAT(registered("y1", "assumed"),
              Fails(kInvalid, "'assumed' has z (assumed) up, but the source 'y1' has y up"));
  EXPECT_THAT(registered("assumed", "y1"),
              Fails(kInvalid, "'y1' has y up, but the source 'assumed' has z (assumed) up"));
  EXPECT_THAT(registered("assumed", "z"), Succeeds());
  EXPECT_THAT(registered("y1", "y2"), Succeeds());
}

TEST_F(CheckAnimationsTest, AnotherLengthIsTaken) {
  EXPECT_THAT(RegisterTo([](auto& b) { b.set_num_frames(3 * kFamilyFrames); }), Succeeds());
}

TEST_F(CheckAnimationsTest, ASingleFrameIsRefused) {
  EXPECT_THAT(
      RegisterTo([](auto& b) { b.set_num_frames(1); }),
      Fails(kInvalid, "targets[0]: animation 'b' has 1 frames; a registration needs 2 or more"));
}

TEST_F(CheckAnimationsTest, ASourceWithoutLiquidIsRefused) {
  AnimationManifest empty = SmallManifest();
  empty.clear_mean_edge_length_m();
  ImportAnimation("a", empty);
  ImportAnimation("b");
  EXPECT_THAT(RegisterFamily(backends_, Registration()),
              Fails(kInvalid, "source: animation 'a' has no liquid in any frame"));
}

TEST_F(CheckAnimationsTest, ACorrespondenceAfterTheEndIsRefusedByItsField) {
  ImportAnimation("a");
  AnimationManifest fractional = SmallManifest();  // its last whole frame is 3
  fractional.set_num_frames(3);
  for (const double time : {0.0, 1.5, 3.75}) fractional.add_times(time);
  ImportAnimation("b", fractional);
  const auto at = [&](double source_s, double target_s) {
    return RegisterWith([&](v1::Correspondence& correspondence) {
      correspondence.mutable_source()->set_time_s(source_s);
      correspondence.mutable_target()->set_time_s(target_s);
    });
  };
  EXPECT_THAT(at(1e6, 0), Fails(kInvalid,
                                "correspondences[0].correspondences[0].source.time_s: is 1e+06 s, "
                                "but animation 'a' ends at "));
  EXPECT_THAT(at(0, 3.5 / 24), Fails(kInvalid,
                                     "correspondences[0].correspondences[0].target.time_s: is "
                                     "0.145833 s, but animation 'b' ends at 0.125 s"));
  EXPECT_THAT(at(0, 3.0 / 24), Succeeds());
}

}  // namespace
}  // namespace liquidblend::server
