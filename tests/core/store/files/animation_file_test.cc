#include <limits>

#include "core/store/files/files.h"
#include "tests/core/store/files/file_testing.h"

namespace liquidblend::store::animation_file_test {
namespace {

using Code = absl::StatusCode;
using Manifest = v1::AnimationManifest;

mesh::TriangleMesh Tetrahedron(float size) {
  mesh::TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, size, 0, 0,  //
      0, 0, size, 0,               //
      0, 0, 0, size;
  mesh.triangles.resize(3, 4);
  mesh.triangles << 0, 0, 0, 1,  //
      2, 1, 3, 2,                //
      1, 3, 2, 3;
  return mesh;
}

// Three frames: with velocities, without them, and without anything.
mesh::Animation Sample() {
  mesh::Animation animation;
  animation.name = "drops";
  animation.frames_per_second = 25.0;
  animation.first_frame_number = 7;
  animation.frames = {Tetrahedron(1.0f), Tetrahedron(2.0f), mesh::TriangleMesh()};
  animation.frames[0].velocities = Eigen::Matrix3Xf::Constant(3, 4, 0.5f);
  animation.notes = {"frame 3: removed 2 slivers"};
  return animation;
}

std::string Written(const mesh::Animation& animation) {
  MemoryWriter writer;
  EXPECT_THAT(WriteAnimation(animation, writer), Succeeds());
  return writer.content;
}

absl::StatusOr<mesh::Animation> Read(const std::string& content) {
  return ReadAnimation(MemoryBlob(content), "a.lbanm");
}

std::string Changed(const std::function<void(Manifest&)>& change) {
  return WithManifest<Manifest>(Written(Sample()), change);
}

TEST(AnimationFile, GivesBackTheAnimation) {
  const mesh::Animation sample = Sample();
  const auto animation = Read(Written(sample));
  ASSERT_THAT(animation, Succeeds());
  EXPECT_EQ(animation->name, "drops");
  EXPECT_EQ(animation->frames_per_second, 25.0);
  EXPECT_EQ(animation->first_frame_number, 7);
  EXPECT_EQ(animation->notes, sample.notes);
  ASSERT_EQ(animation->num_frames(), 3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(animation->frames[k].vertices, sample.frames[k].vertices);
    EXPECT_EQ(animation->frames[k].triangles, sample.frames[k].triangles);
    EXPECT_EQ(animation->frames[k].velocities, sample.frames[k].velocities);
  }
}

TEST(AnimationFile, KeepsTheTimesOfFrames) {
  mesh::Animation sample = Sample();
  sample.times = {0.0, 1.25, 4.0};
  const auto animation = Read(Written(sample));
  ASSERT_THAT(animation, Succeeds());
  EXPECT_EQ(animation->times, sample.times);
  EXPECT_EQ(animation->time(2), 4.0);
  EXPECT_TRUE(Read(Written(Sample()))->times.empty());
}

// A reader that knows no times must not play the frames as if there were none.
TEST(AnimationFile, HasFormatVersion2OnlyWithTimes) {
  constexpr size_t kVersionOffset = 16;
  EXPECT_EQ(Written(Sample())[kVersionOffset], 1);
  mesh::Animation sample = Sample();
  sample.times = {0.0, 1.25, 4.0};
  EXPECT_EQ(Written(sample)[kVersionOffset], 2);
}

TEST(AnimationFile, RefusesTimesThatDoNotRiseFromZeroOrAreNotOnePerFrame) {
  const auto with_times = [](const std::vector<double>& times) {
    mesh::Animation sample = Sample();
    sample.times = times;
    return Read(Written(sample)).status();
  };
  EXPECT_THAT(with_times({0.0, 1.0}), Fails(Code::kInvalidArgument, "2 times for 3 frames"));
  EXPECT_THAT(with_times({1.0, 2.0, 3.0}),
              Fails(Code::kInvalidArgument, "the time of frame 0 is 1"));
  EXPECT_THAT(with_times({0.0, 2.0, 2.0}),
              Fails(Code::kInvalidArgument, "the time of frame 2 is 2"));
  EXPECT_THAT(with_times({0.0, 2.0, std::numeric_limits<double>::infinity()}),
              Fails(Code::kInvalidArgument, "the time of frame 2 is inf"));
  EXPECT_THAT(with_times({0.0, std::numeric_limits<double>::quiet_NaN(), 3.0}),
              Fails(Code::kInvalidArgument, "the time of frame 1 is nan"));
}

// Older files say nothing.
TEST(AnimationFile, KeepsWhatIsUp) {
  EXPECT_EQ(Read(Written(Sample()))->up, mesh::Up::kUnknown);
  mesh::Animation sample = Sample();
  sample.up = mesh::Up::kMinusY;
  EXPECT_EQ(Read(Written(sample))->up, mesh::Up::kMinusY);
  EXPECT_EQ(ManifestOf(sample).up(), v1::UP_MINUS_Y);
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.set_up(static_cast<v1::Up>(7)); })),
              Fails(Code::kInvalidArgument, "up = 7"));
}

TEST(AnimationFile, NeedsNoAlignedMemory) {
  EXPECT_THAT(ReadAnimation(MemoryBlob(Written(Sample()), 1), "a"), Succeeds());
}

TEST(AnimationFile, TellsTheCatalogAboutItself) {
  const Manifest manifest = ManifestOf(Sample());
  EXPECT_EQ(manifest.name(), "drops");
  EXPECT_EQ(manifest.num_frames(), 3);
  EXPECT_EQ(manifest.first_frame_number(), 7);
  EXPECT_GT(manifest.mean_edge_length_m(), 1.0);
  EXPECT_THAT(manifest.bounds().min(), ::testing::ElementsAre(0, 0, 0));
  EXPECT_THAT(manifest.bounds().max(), ::testing::ElementsAre(2, 2, 2));
  EXPECT_EQ(manifest.notes(0), "frame 3: removed 2 slivers");
  EXPECT_EQ(manifest.sections_size(), 0);
}

TEST(AnimationFile, NoticesEachByteThatChanges) {
  const std::string whole = Written(Sample());
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 0xff);
    const absl::Status status = Read(changed).status();
    EXPECT_TRUE(absl::IsDataLoss(status) || absl::IsInvalidArgument(status)) << i;
    EXPECT_TRUE(absl::StrContains(status.message(), "animation file a.lbanm: ")) << status;
  }
}

TEST(AnimationFile, NoticesEachLengthThatIsNotItsOwn) {
  const std::string whole = Written(Sample());
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THAT(Read(whole.substr(0, size)), Fails(Code::kDataLoss, "animation file a.lbanm: "))
        << size;
  }
}

TEST(AnimationFile, IsNoFamilyFile) {
  auto blob = std::make_shared<MemoryBlob>(Written(Sample()));
  EXPECT_THAT(OpenFamily(std::move(blob), "a"),
              Fails(Code::kInvalidArgument, "family file a: is not a file of this type"));
}

TEST(AnimationFile, RefusesAManifestThatContradictsItself) {
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.set_num_frames(2); })),
              Fails(Code::kInvalidArgument, "9 sections for 2 frames"));
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.set_num_frames(-3); })),
              Fails(Code::kInvalidArgument, "9 sections for -3 frames"));
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.set_num_frames(1 << 30); })),
              Fails(Code::kInvalidArgument, "sections for 1073741824 frames"));
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.set_frames_per_second(0.0); })),
              Fails(Code::kInvalidArgument, "frames_per_second = 0"));
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.set_frames_per_second(1e10); })),
              Fails(Code::kInvalidArgument, "frames_per_second = 1e+10"));
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.mutable_sections(4)->set_name("faces.1"); })),
              Fails(Code::kInvalidArgument, "has section faces.1 in the place of triangles.1"));
}

TEST(AnimationFile, RefusesSectionsThatReachBeyondTheFile) {
  EXPECT_THAT(Read(Changed([](Manifest& m) { m.mutable_sections(3)->set_count(5000); })),
              Fails(Code::kDataLoss, "section vertices.1: has 5000 elements"));
}

// The file with the 4 bytes at the start of a section changed, and its checksum right again.
template <typename Number>
std::string WithFirstNumber(int section, Number number) {
  std::string file = Written(Sample());
  size_t offset = 0;
  std::string elements;
  const auto fix = [&](Manifest& m) {
    offset = m.sections(section).offset();
    elements = file.substr(offset, m.sections(section).count() * 12);
    std::memcpy(elements.data(), &number, sizeof(number));
    m.mutable_sections(section)->set_xxh3(Checksum(AsBytes(elements)));
  };
  file = WithManifest<Manifest>(file, fix);
  return file.replace(offset, elements.size(), elements);
}

TEST(AnimationFile, NamesTheFrameThatCannotBeUsed) {
  EXPECT_THAT(Read(WithFirstNumber<int32_t>(4, 4)),
              Fails(Code::kInvalidArgument, "a.lbanm: frame 1: "));
  EXPECT_THAT(Read(WithFirstNumber<int32_t>(4, -1)),
              Fails(Code::kInvalidArgument, "a.lbanm: frame 1: "));
  EXPECT_THAT(Read(WithFirstNumber(0, std::numeric_limits<float>::infinity())),
              Fails(Code::kInvalidArgument, "a.lbanm: frame 0: "));
  EXPECT_THAT(Read(WithFirstNumber<int32_t>(4, 2)), Succeeds());
}

}  // namespace
}  // namespace liquidblend::store::animation_file_test
