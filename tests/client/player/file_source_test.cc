#include "client/player/file_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

#include "core/frames/blend_weights.h"
#include "core/store/files/files.h"
#include "liquidblend/decode.h"
#include "server/frames/make_frame.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/families.h"

namespace liquidblend::player {
namespace {

using ::testing::HasSubstr;

mesh::RegisteredFamily TestFamily() {
  synthetic::ComplexOptions options;
  options.num_frames = 8;
  options.velocity_m_per_frame = {0.05F, 0.02F, 0.04F};
  const std::vector<synthetic::TargetFields> targets = {{synthetic::SmoothWarp(1, 0.1F, 0.5F), {}},
                                                        {synthetic::SmoothWarp(2, 0.1F, 0.5F), {}}};
  mesh::RegisteredFamily family =
      synthetic::MakeFamily(synthetic::MixedSphere(8, options), targets);
  family.name = "splash";
  family.targets[0].name = "b";
  family.targets[1].name = "c";
  family.coarser_levels.push_back(
      synthetic::MakeFamily(synthetic::MixedSphere(4, options), targets));
  family.coarser_levels[0].targets[0].name = "b";
  family.coarser_levels[0].targets[1].name = "c";
  family.coarser_levels[0].domain_min = family.domain_min;
  family.coarser_levels[0].domain_max = family.domain_max;
  family.parameter_space = {{"width", "height"}, {{0, 0}, {1, 0}, {0, 1}}};
  return family;
}

class FileSourceTest : public ::testing::Test {
 protected:
  FileSourceTest() {
    store::MemoryWriter writer;
    EXPECT_TRUE(store::WriteFamily(TestFamily(), writer).ok());
    store::WriteFile(path_, writer.content);
    auto source = FileSource::Open(path_);
    EXPECT_TRUE(source.ok()) << source.status();
    if (source.ok()) source_ = *std::move(source);
  }

  absl::Status Get(const FrameSpec& spec, FrameMesh& out) const {
    FrameCost cost;
    return source_->Get(spec, *pool_, out, cost);
  }

  const store::TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/splash.lbf";
  const std::shared_ptr<FramePool> pool_ = std::make_shared<FramePool>(Allocator());
  std::unique_ptr<FileSource> source_;
};

template <typename T>
bool SameBytes(const std::vector<T>& expected, const T* actual) {
  return expected.empty() || std::memcmp(expected.data(), actual, expected.size() * sizeof(T)) == 0;
}

TEST_F(FileSourceTest, SaysWhatTheFamilyIs) {
  ASSERT_NE(source_, nullptr);
  const FamilyFacts& facts = source_->facts();
  EXPECT_EQ(facts.name, "families/splash");
  EXPECT_EQ(facts.targets, (std::vector<std::string>{"animations/b", "animations/c"}));
  EXPECT_EQ(facts.num_levels, 2);
  EXPECT_GT(facts.duration_s, 0.2);
  EXPECT_EQ(facts.parameter_space.names, (std::vector<std::string>{"width", "height"}));
}

// The server's bytes, decoded by the client, at 200 random weights and times.
TEST_F(FileSourceTest, MakesTheServersFramesToTheBit) {
  ASSERT_NE(source_, nullptr);
  auto space = frames::MakeOptionalSpace(TestFamily().parameter_space);
  const catalog::LoadedFamily loaded(TestFamily(), *std::move(space));
  server::FrameBuffers buffers;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> weight(-0.5, 1.5), share(0.0, 1.0);
  FrameMesh mine{Allocator()};
  for (int n = 0; n < 200; ++n) {
    FrameSpec spec;
    spec.blend.weights = {weight(random), weight(random)};
    spec.time_s = share(random) * source_->facts().duration_s;
    spec.surface.level_of_detail = n % 2;
    spec.surface.normals = n % 3 == 0;
    spec.surface.velocities = n % 5 == 0;
    spec.surface.rest_positions = n % 7 == 0;
    spec.position_bits = n % 2 == 0 ? 0 : 16;
    server::FrameQuery query;
    query.weights = frames::ClampWeights(loaded, spec.blend.weights).weights;
    query.time_s = spec.time_s;
    query.encoding.set_format(v1::Encoding::MESHOPT);
    query.encoding.set_position_bits(spec.position_bits);
    query.surface.set_level_of_detail(spec.surface.level_of_detail);
    if (spec.surface.normals) query.surface.add_attributes(v1::SurfaceOptions::NORMALS);
    if (spec.surface.velocities) query.surface.add_attributes(v1::SurfaceOptions::VELOCITIES);
    if (spec.surface.rest_positions) {
      query.surface.add_attributes(v1::SurfaceOptions::REST_POSITIONS);
    }
    const auto frame = server::MakeFrame(loaded, query, buffers);
    ASSERT_TRUE(frame.ok()) << frame.status();
    const auto theirs = DecodeMesh(frame->data());
    ASSERT_TRUE(theirs.ok()) << theirs.status();
    ASSERT_TRUE(Get(spec, mine).ok());
    ASSERT_EQ(mine.num_vertices(), theirs->num_vertices()) << n;
    ASSERT_EQ(mine.num_triangles(), theirs->num_triangles()) << n;
    EXPECT_TRUE(SameBytes(theirs->positions, mine.memory().positions)) << n;
    EXPECT_TRUE(SameBytes(theirs->triangles, mine.memory().triangles)) << n;
    EXPECT_EQ(mine.memory().normals != nullptr, spec.surface.normals);
    EXPECT_TRUE(SameBytes(theirs->normals, mine.memory().normals)) << n;
    EXPECT_TRUE(SameBytes(theirs->velocities, mine.memory().velocities)) << n;
    EXPECT_TRUE(SameBytes(theirs->rest, mine.memory().rest)) << n;
  }
}

TEST_F(FileSourceTest, TakesAPointInParameterSpace) {
  ASSERT_NE(source_, nullptr);
  FrameMesh mesh{Allocator()};
  FrameSpec spec;
  spec.blend.parameters = {{"width", 0.25}, {"height", 0.5}};
  ASSERT_TRUE(Get(spec, mesh).ok());
  EXPECT_THAT(mesh.facts.weights, ::testing::ElementsAre(testing::DoubleNear(0.25, 1e-9),
                                                       ::testing::DoubleNear(0.5, 1e-9)));
  EXPECT_FALSE(mesh.facts.is_extrapolated);
  spec.blend.parameters = {{"width", 2.0}, {"height", 2.0}};
  EXPECT_TRUE(absl::IsOutOfRange(Get(spec, mesh)));
  spec.blend.parameters = {{"width", 2.0}};
  EXPECT_THAT(std::string(Get(spec, mesh).message()), HasSubstr("height"));
}

TEST_F(FileSourceTest, NamesWhatIsWrongWithARequest) {
  ASSERT_NE(source_, nullptr);
  FrameMesh mesh{Allocator()};
  const auto error_of = [&](auto change) {
    FrameSpec spec;
    spec.blend.weights = {0.5, 0.5};
    change(spec);
    const absl::Status status = Get(spec, mesh);
    EXPECT_FALSE(status.ok());
    return std::string(status.message());
  };
  EXPECT_THAT(error_of([](FrameSpec& s) { s.blend.weights = {1}; }), HasSubstr("1"));
  EXPECT_THAT(error_of([](FrameSpec& s) { s.blend.weights = {1, NAN}; }), HasSubstr("nan"));
  EXPECT_THAT(error_of([](FrameSpec& s) { s.time_s = 99; }), HasSubstr("99"));
  EXPECT_THAT(error_of([](FrameSpec& s) { s.position_bits = 17; }), HasSubstr("position_bits"));
  EXPECT_THAT(error_of([](FrameSpec& s) { s.surface.level_of_detail = 2; }),
              HasSubstr("level_of_detail"));
  EXPECT_THAT(error_of([](FrameSpec& s) { s.surface.smoothing_passes = 99; }), HasSubstr("passes"));
}

TEST_F(FileSourceTest, NamesAFileThatIsNotThereOrIsNoFamily) {
  EXPECT_TRUE(absl::IsNotFound(FileSource::Open(folder_.path() + "/none").status()));
  const std::string text = folder_.path() + "/text";
  store::WriteFile(text, "hello");
  const absl::Status not_a_family = FileSource::Open(text).status();
  EXPECT_TRUE(absl::IsInvalidArgument(not_a_family)) << not_a_family;
  EXPECT_THAT(std::string(not_a_family.message()), HasSubstr(text));
  std::string damaged = store::ReadFile(path_);
  damaged[damaged.size() - 100] ^= 1;
  store::WriteFile(text, damaged);
  EXPECT_TRUE(absl::IsDataLoss(FileSource::Open(text).status()));
}

}  // namespace
}  // namespace liquidblend::player
