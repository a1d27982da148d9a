#include "server/frames/encoding.h"

#include <cmath>

#include "absl/strings/numbers.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class EncodingTest : public RpcTest {
 protected:
  EncodingTest() : backends_(*catalog_, *blobs_, families_, SmallBackends()) {}
  ~EncodingTest() override { backends_.Stop(); }

  void SetUp() override {
    PublishSplash();
    loaded_ = *families_.Get("splash");
  }

  absl::StatusOr<v1::Frame> Frame(const v1::Encoding& encoding) {
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    request.set_time_s(0.1);
    *request.mutable_encoding() = encoding;
    return GetFrame(backends_, request);
  }

  static v1::Encoding Bits(int bits) {
    v1::Encoding encoding;
    encoding.set_position_bits(bits);
    return encoding;
  }
  static v1::Encoding Step(double step_m) {
    v1::Encoding encoding;
    encoding.set_position_step_m(step_m);
    return encoding;
  }

  double StepOf(int bits) const { return frames::StepOf(loaded_->grid, bits); }

  Backends backends_;
  catalog::FamilyPtr loaded_;
};

TEST_F(EncodingTest, AStepGivesTheBytesAndTheCachedFrameOfItsBits) {
  for (const int bits : {8, 12, 20}) {
    const auto by_bits = Frame(Bits(bits));
    ASSERT_THAT(by_bits, Succeeds());
    const int64_t num_frames = backends_.frame_cache.stats().num_frames;
    const auto by_step = Frame(Step(StepOf(bits)));
    ASSERT_THAT(by_step, Succeeds());
    EXPECT_EQ(by_step->data(), by_bits->data());
    EXPECT_EQ(backends_.frame_cache.stats().num_frames, num_frames);
  }
  EXPECT_EQ(Frame(Step(1000))->data(), Frame(Bits(8))->data());
  EXPECT_NE(Frame(Step(StepOf(12)))->data(), Frame(Bits(11))->data());
}

TEST_F(EncodingTest, AStepThatCannotBeIsRefusedWithItsValueAndTheFinestOne) {
  for (const double step_m : {StepOf(20) * 0.99, -0.001, double{NAN}, double{INFINITY}}) {
    const auto frame = Frame(Step(step_m));
    EXPECT_THAT(frame,
                Fails(absl::StatusCode::kInvalidArgument, "the finest step of family splash"));
    EXPECT_THAT(std::string(frame.status().message()), HasSubstr(absl::StrCat("got ", step_m)));
    EXPECT_THAT(BlamedFields(frame.status()), ElementsAre("encoding.position_step_m"));
  }
}

TEST_F(EncodingTest, TheFinestStepThatARefusalNamesIsServed) {
  const std::string message(Frame(Step(1e-12)).status().message());
  const std::string from = "a length from ";
  double finest_m = 0;
  const size_t begin = message.find(from) + from.size();
  ASSERT_TRUE(absl::SimpleAtod(message.substr(begin, message.find(' ', begin) - begin), &finest_m))
      << message;
  const auto frame = Frame(Step(finest_m));
  ASSERT_THAT(frame, Succeeds());
  EXPECT_EQ(frame->data(), Frame(Bits(20))->data());
}

TEST_F(EncodingTest, BitsAndStepExcludeEachOther) {
  v1::Encoding both = Bits(12);
  both.set_position_step_m(0.01);
  const auto frame = Frame(both);
  EXPECT_THAT(frame, Fails(absl::StatusCode::kInvalidArgument,
                           "excludes position_bits, got 0.01 m and 12 bits"));
  EXPECT_THAT(BlamedFields(frame.status()), ElementsAre("encoding.position_step_m"));
}

TEST_F(EncodingTest, PlyAndObjAreFilesOfTheSameSurface) {
  v1::Encoding ply, obj;
  ply.set_format(v1::Encoding::PLY);
  obj.set_format(v1::Encoding::OBJ);
  const auto draco = Frame({}), as_ply = Frame(ply), as_obj = Frame(obj);
  ASSERT_THAT(as_ply, Succeeds());
  ASSERT_THAT(as_obj, Succeeds());
  EXPECT_THAT(as_ply->data(), StartsWith("ply\nformat binary_little_endian"));
  EXPECT_THAT(as_ply->data(), HasSubstr(absl::StrCat("vertex ", draco->num_vertices(), "\n")));
  EXPECT_THAT(as_ply->data(), HasSubstr(absl::StrCat("face ", draco->num_triangles(), "\n")));
  EXPECT_THAT(as_obj->data(), StartsWith("v "));
  EXPECT_EQ(Frame({})->data(), draco->data());  // from the cache, which keeps all three apart
}

TEST_F(EncodingTest, WhatIsForDracoAloneIsRefusedOfOtherFormats) {
  v1::Encoding encoding = Bits(12);
  encoding.set_format(v1::Encoding::PLY);
  EXPECT_THAT(BlamedFields(Frame(encoding).status()), ElementsAre("encoding.position_bits"));
  encoding = Step(0.1);
  encoding.set_format(v1::Encoding::OBJ);
  EXPECT_THAT(BlamedFields(Frame(encoding).status()), ElementsAre("encoding.position_step_m"));
  encoding.set_position_step_m(0);
  encoding.set_preset(v1::Encoding::SMALLEST);
  EXPECT_THAT(BlamedFields(Frame(encoding).status()), ElementsAre("encoding.preset"));
  v1::GetFrameRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.mutable_encoding()->set_format(v1::Encoding::OBJ);
  request.mutable_surface()->add_attributes(v1::SurfaceOptions::VELOCITIES);
  EXPECT_THAT(BlamedFields(GetFrame(backends_, request).status()),
              ElementsAre("surface.attributes"));
}

TEST_F(EncodingTest, InAStreamTheNewerOfBitsAndStepReplacesTheOther) {
  SimpleStream stream(families_);
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_rate(0);
  request.set_time_s(0.1);
  *request.mutable_encoding() = Step(StepOf(10));
  ASSERT_TRUE(stream.Change(request).ok());
  EXPECT_EQ(stream.MakeNext()->frame().data(), Frame(Bits(10))->data());
  for (const auto& [newer, bits] : {std::pair{Bits(12), 12}, std::pair{Step(StepOf(9)), 9}}) {
    v1::StreamFramesRequest change;
    *change.mutable_encoding() = newer;
    ASSERT_TRUE(stream.Change(change).ok());
    EXPECT_EQ(stream.MakeNext()->frame().data(), Frame(Bits(bits))->data());
  }
  v1::StreamFramesRequest both;
  *both.mutable_encoding() = Step(0.01);
  both.mutable_encoding()->set_position_bits(9);
  EXPECT_THAT(BlamedFields(stream.Change(both)), ElementsAre("encoding.position_step_m"));
}

}  // namespace
}  // namespace liquidblend::server
