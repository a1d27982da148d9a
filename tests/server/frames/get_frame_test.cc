#include "server/frames/get_frame.h"

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tests/server/api/handlers_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;

using GetFrameTest = HandlersTest;

TEST_F(GetFrameTest, AFrameIsFinishedAsAskedFor) {
  PublishSplash();
  const std::string plain = Frame([](auto&) {})->data();
  std::set<std::string> frames = {plain};
  const std::vector<std::function<void(v1::SurfaceOptions&)>> changes = {
      [](auto& s) { s.set_smoothing_passes(2); },
      [](auto& s) {
        s.set_smoothing_passes(2);
        s.set_smoothing(v1::SurfaceOptions::LAPLACIAN);
      },
      [](auto& s) {
        s.set_smoothing_passes(2);
        s.set_smoothing_strength(0.25);
      },
      [](auto& s) { s.set_temporal_smoothing(1); },
      [](auto& s) { s.add_attributes(v1::SurfaceOptions::NORMALS); },
      [](auto& s) { s.add_attributes(v1::SurfaceOptions::VELOCITIES); }};
  for (const auto& change : changes) {
    const auto ask = [&](v1::GetFrameRequest& request) { change(*request.mutable_surface()); };
    const absl::StatusOr<v1::Frame> frame = Frame(ask);
    ASSERT_THAT(frame, Succeeds());
    EXPECT_EQ(frame->data(), Frame(ask)->data());
    frames.insert(frame->data());
  }
  EXPECT_EQ(frames.size(), 1 + changes.size());  // all differ
  EXPECT_EQ(Frame([](auto& r) { r.mutable_surface(); })->data(), plain);
}

TEST_F(GetFrameTest, AFrameIsTheSameBytesAgain) {
  PublishSplash();
  const auto first = Frame([](auto&) {});
  const auto second = Frame([](auto&) {});
  ASSERT_THAT(first, Succeeds());
  EXPECT_EQ(first->SerializeAsString(), second->SerializeAsString());
  EXPECT_EQ(first->data().substr(0, 5), "DRACO");
  EXPECT_EQ(first->family(), "families/splash");
  EXPECT_EQ(first->version(), 1);
  EXPECT_THAT(first->weights(), ElementsAre(0.5));
  EXPECT_EQ(first->time_s(), 0.1);
  EXPECT_GT(first->num_triangles(), 100);
  EXPECT_LT(first->bounds().min().x(), -0.8);
  EXPECT_GT(first->bounds().max().x(), 0.8);
}

TEST_F(GetFrameTest, AFrameFollowsTheNewestVersionAndNamesIt) {
  PublishSplash();
  const auto old = Frame([](auto&) {});
  PublishFamily("splash", "a", "b", 2);
  const auto now = Frame([](auto& r) { r.set_version(2); });  // waits until it is loaded
  ASSERT_THAT(now, Succeeds());
  EXPECT_EQ(now->version(), 2);
  EXPECT_EQ(Frame([](auto&) {})->version(), 2);
  EXPECT_NE(now->data(), old->data());
  EXPECT_THAT(Frame([](auto& r) { r.set_version(1); }), Fails(absl::StatusCode::kNotFound, "1"));
}

TEST_F(GetFrameTest, PresetsGiveOtherBytesOfTheSameTriangles) {
  PublishSplash();
  const auto fastest = Frame([](auto&) {});
  ASSERT_THAT(fastest, Succeeds());
  for (const auto preset :
       {v1::Encoding::FASTEST, v1::Encoding::BALANCED, v1::Encoding::SMALLEST}) {
    const auto frame = Frame([&](auto& r) { r.mutable_encoding()->set_preset(preset); });
    ASSERT_THAT(frame, Succeeds());
    EXPECT_EQ(frame->num_triangles(), fastest->num_triangles());
    EXPECT_EQ(frame->data() == fastest->data(), preset == v1::Encoding::FASTEST);
  }
}

TEST_F(GetFrameTest, AStreamShowsTheFramesThatGetFrameGives) {
  PublishSplash();
  SimpleStream stream(families_);
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_lossless(true);
  ASSERT_TRUE(stream.Change(request).ok());
  int num_frames = 0;
  while (const auto tick = stream.stream.Next(absl::ZeroDuration())) {
    const auto response = stream.Make(*tick);
    ASSERT_THAT(response, Succeeds());
    EXPECT_EQ(response->frame_index(), num_frames);
    const auto frame = Frame([&](auto& r) { r.set_time_s(tick->time_s); });
    EXPECT_EQ(response->frame().data(), frame->data());
    ++num_frames;
  }
  EXPECT_EQ(num_frames, kFamilyFrames);
}

TEST_F(GetFrameTest, AStreamKeepsWhatAMessageDoesNotSet) {
  PublishSplash();
  SimpleStream stream(families_);
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.25);
  request.set_time_s(0.1);
  request.set_rate(0);
  request.mutable_encoding()->set_position_bits(10);
  ASSERT_TRUE(stream.Change(request).ok());
  v1::StreamFramesRequest other_weights;
  other_weights.add_weights(0.75);
  other_weights.mutable_encoding()->set_preset(v1::Encoding::BALANCED);
  ASSERT_TRUE(stream.Change(other_weights).ok());
  const auto response = stream.MakeNext();
  ASSERT_THAT(response, Succeeds());
  EXPECT_THAT(response->frame().weights(), ElementsAre(0.75));
  EXPECT_EQ(response->frame().time_s(), 0.1);
  const auto expected = Frame([](auto& r) {
    r.set_weights(0, 0.75);
    r.mutable_encoding()->set_position_bits(10);
    r.mutable_encoding()->set_preset(v1::Encoding::BALANCED);
  });
  EXPECT_EQ(response->frame().data(), expected->data());
}

}  // namespace
}  // namespace liquidblend::server
