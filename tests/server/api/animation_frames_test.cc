// Frames of animations as they were imported.
#include <span>

#include "server/api/handlers.h"
#include "tests/server/backends_testing.h"
#include "tests/synthetic/shapes.h"
#include "worker/ingest/formats/readers.h"

namespace liquidblend::server::animation_frames_test {
namespace {

using store::Fails;

class AnimationFramesTest : public RpcTest {
 protected:
  AnimationFramesTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {
    animation_ = synthetic::MovingSphere({.num_frames = 4});
    animation_.name = "ball";
    animation_.first_frame_number = 13;
  }
  ~AnimationFramesTest() override { backends_.Stop(); }

  void SetUp() override { Publish(); }

  void Publish() {
    SubmitImport("ball");
    auto writer = *blobs_->Create();
    ASSERT_TRUE(store::WriteAnimation(animation_, *writer).ok());
    store::pb::AnimationRecord record;
    record.set_id("ball");
    record.set_blob(*writer->Commit());
    *record.mutable_manifest() = store::ManifestOf(animation_);
    ASSERT_TRUE(catalog_->PublishAnimation(TakeJob().lease_id, record).ok());
  }

  static v1::GetAnimationFrameRequest Request(v1::Encoding::Format format = v1::Encoding::PLY) {
    v1::GetAnimationFrameRequest request;
    request.set_animation("animations/ball");
    request.mutable_encoding()->set_format(format);
    return request;
  }

  static mesh::TriangleMesh Decoded(const v1::AnimationFrame& frame) {
    const auto mesh = ingest::ReadPly(std::as_bytes(std::span(frame.data())));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? *mesh : mesh::TriangleMesh();
  }

  mesh::Animation animation_;
  Backends backends_;
};

TEST_F(AnimationFramesTest, AreThoseOfTheFile) {
  v1::GetAnimationFrameRequest request = Request();
  request.set_frame_number(15);
  const auto frame = GetAnimationFrame(backends_, request);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->animation(), "animations/ball");
  EXPECT_EQ(frame->frame_number(), 15);
  EXPECT_DOUBLE_EQ(frame->time_s(), 2.0 / 24);
  EXPECT_EQ(frame->num_triangles(), animation_.frames[2].num_triangles());
  EXPECT_EQ(Decoded(*frame).vertices, animation_.frames[2].vertices);
  EXPECT_EQ(Decoded(*frame).triangles, animation_.frames[2].triangles);
  EXPECT_FLOAT_EQ(static_cast<float>(frame->bounds().min().y()),
                  animation_.frames[2].vertices.row(1).minCoeff());
}

TEST_F(AnimationFramesTest, ATimeMeansTheNearestOne) {
  for (const auto& [time_s, number] : std::vector<std::pair<double, int>>{
           {0, 13}, {0.4 / 24, 13}, {0.6 / 24, 14}, {3.0 / 24, 16}}) {
    v1::GetAnimationFrameRequest request = Request();
    request.set_time_s(time_s);
    EXPECT_EQ(GetAnimationFrame(backends_, request)->frame_number(), number) << time_s;
  }
  EXPECT_EQ(GetAnimationFrame(backends_, Request())->frame_number(), 13) << "none: the first";
}

TEST_F(AnimationFramesTest, LevelsHaveFewerTrianglesAndAreClosed) {
  v1::GetAnimationFrameRequest request = Request();
  int64_t before = animation_.frames[0].num_triangles();
  for (int level = 1; level <= 3; ++level) {
    request.set_level_of_detail(level);
    const auto frame = GetAnimationFrame(backends_, request);
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_LT(frame->num_triangles(), before);
    EXPECT_TRUE(mesh::CheckClosed(Decoded(*frame)).closed());
    before = frame->num_triangles();
  }
}

TEST_F(AnimationFramesTest, AttributesComeAlong) {
  v1::GetAnimationFrameRequest request = Request();
  request.add_attributes(v1::SurfaceOptions::NORMALS);
  request.add_attributes(v1::SurfaceOptions::VELOCITIES);
  const auto frame = GetAnimationFrame(backends_, request);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(Decoded(*frame).velocities, animation_.frames[0].velocities);
  const auto draco = GetAnimationFrame(backends_, Request(v1::Encoding::DRACO));
  ASSERT_TRUE(draco.ok()) << draco.status();
  EXPECT_EQ(draco->data().substr(0, 5), "DRACO");
}

TEST_F(AnimationFramesTest, MistakesAreNamed) {
  const auto blamed = [&](const v1::GetAnimationFrameRequest& request) {
    const auto fields = BlamedFields(GetAnimationFrame(backends_, request).status());
    return fields.empty() ? "" : fields[0];
  };
  v1::GetAnimationFrameRequest request = Request();
  request.set_frame_number(12);
  EXPECT_EQ(blamed(request), "frame_number");
  request.set_frame_number(17);
  EXPECT_EQ(blamed(request), "frame_number");
  request.set_time_s(1);
  EXPECT_EQ(blamed(request), "time_s");
  request.set_time_s(std::nan(""));
  EXPECT_EQ(blamed(request), "time_s");
  request = Request();
  request.set_level_of_detail(9);
  EXPECT_EQ(blamed(request), "level_of_detail");
  request = Request(v1::Encoding::OBJ);
  request.add_attributes(v1::SurfaceOptions::VELOCITIES);
  EXPECT_EQ(blamed(request), "attributes");
  request = Request(v1::Encoding::DRACO);
  request.mutable_encoding()->set_position_bits(40);
  EXPECT_EQ(blamed(request), "encoding.position_bits");
  request.set_animation("animations/none");
  EXPECT_TRUE(absl::IsNotFound(GetAnimationFrame(backends_, request).status()));
  SubmitImport("late");
  request.set_animation("late");
  EXPECT_TRUE(absl::IsFailedPrecondition(GetAnimationFrame(backends_, request).status()));
}

TEST_F(AnimationFramesTest, ManyAnimationsMayBeLookedAt) {
  for (size_t k = 0; k < 2 * OpenAnimations::kMaxOpen; ++k) {
    animation_.frames[0].vertices(0, 0) += 0.01F;
    auto writer = *blobs_->Create();
    ASSERT_TRUE(store::WriteAnimation(animation_, *writer).ok());
    EXPECT_TRUE(backends_.animations.Open(*writer->Commit(), "ball").ok());
  }
  EXPECT_TRUE(GetAnimationFrame(backends_, Request()).ok());
}

}  // namespace
}  // namespace liquidblend::server::animation_frames_test
