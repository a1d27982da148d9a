#include <limits>

#include "core/store/files/files.h"
#include "tests/core/store/files/file_testing.h"

namespace liquidblend::store::target_file_test {
namespace {

using Code = absl::StatusCode;
using Manifest = v1::TargetManifest;

// One registered target, and what it views.
struct Sample {
  std::vector<mesh::Float4> displacement = {7, mesh::Float4{0.1f, 0.2f, 0.3f, 1.0f}};
  std::vector<mesh::Float4> extrapolation = {7, mesh::Float4{0.1f, 0.1f, 0.1f, 0.5f}};

  TargetFile View() const {
    TargetFile file;
    file.target = {"thick", displacement, extrapolation, {120, 16, 0.08, 0.97, 14.5, {}, {}}};
    file.target.report.verdict = DoubtfulVerdict(4.7);
    mesh::CorrespondenceReport& report = file.target.report.correspondences.emplace_back();
    report.correspondence.kind = mesh::CorrespondenceKind::kTrajectory;
    report.correspondence.hard = true;
    report.correspondence.source = {1, 2, 3, 0.1};
    report.correspondence.target = {4, 5, 6,
                                    3.7};  // frames, which no rate turns into whole seconds
    report.correspondence.length_frames = 0.7;
    report.num_nodes = 3;
    report.residual_m = 0.01;
    report.residual_frames = 0.3;
    file.space_time.num_vertices = 7;
    file.space_time.fidelity.num_frames = 16;
    file.source_mesh = "xxh3-00000000000000000000000000000001";
    return file;
  }
};

std::string Whole() {
  const Sample sample;
  MemoryWriter writer;
  EXPECT_THAT(WriteTarget(sample.View(), writer), Succeeds());
  return writer.content;
}

absl::StatusOr<TargetFile> Open(const std::string& content) {
  return OpenTarget(std::make_shared<MemoryBlob>(content), "t.lbtgt");
}

std::string Changed(const std::function<void(Manifest&)>& change) {
  return WithManifest<Manifest>(Whole(), change);
}

TEST(TargetFile, GivesBackEverythingToTheLastBit) {
  const Sample sample;
  const TargetFile before = sample.View();
  const auto file = Open(Whole());
  ASSERT_THAT(file, Succeeds());
  EXPECT_EQ(file->target.name, "thick");
  EXPECT_EQ(file->source_mesh, before.source_mesh);
  EXPECT_EQ(file->space_time.num_vertices, 7);
  EXPECT_EQ(file->space_time.fidelity.num_frames, 16);
  EXPECT_TRUE(std::equal(file->target.displacement.begin(), file->target.displacement.end(),
                         sample.displacement.begin(), sample.displacement.end()));
  EXPECT_TRUE(std::equal(file->target.extrapolation.begin(), file->target.extrapolation.end(),
                         sample.extrapolation.begin(), sample.extrapolation.end()));
  EXPECT_EQ(file->target.report.seconds, 14.5);
  ASSERT_EQ(file->target.report.correspondences.size(), 1);
  EXPECT_EQ(file->target.report.correspondences[0].correspondence,
            before.target.report.correspondences[0].correspondence);
  EXPECT_EQ(file->target.report.verdict.worst, before.target.report.verdict.worst);
  MemoryWriter again;
  ASSERT_THAT(WriteTarget(*file, again), Succeeds());
  EXPECT_EQ(again.content, Whole());
}

TEST(TargetFile, MayHaveNoExtrapolationOfItsOwn) {
  Sample sample;
  sample.extrapolation.clear();
  MemoryWriter writer;
  ASSERT_THAT(WriteTarget(sample.View(), writer), Succeeds());
  const auto file = Open(writer.content);
  ASSERT_THAT(file, Succeeds());
  EXPECT_TRUE(file->target.extrapolation.empty());
  EXPECT_EQ(file->target.displacement.size(), 7);
}

TEST(TargetFile, NoticesAnyChangedOrMissingByte) {
  const std::string whole = Whole();
  for (size_t k = 0; k < whole.size(); ++k) {
    std::string damaged = whole;
    damaged[k] = static_cast<char>(damaged[k] ^ 1);
    EXPECT_FALSE(Open(damaged).ok()) << "byte " << k;
    EXPECT_FALSE(Open(whole.substr(0, k)).ok()) << k << " bytes";
  }
  EXPECT_THAT(Open(whole + '\0'), Fails(Code::kDataLoss, "t.lbtgt"));
}

TEST(TargetFile, RefusesWhatIsNoTargetFile) {
  EXPECT_THAT(Open("something else"), Fails(Code::kInvalidArgument, "is not a file of this type"));
  const auto shifted = std::make_shared<MemoryBlob>(Whole(), 4);
  EXPECT_THAT(OpenTarget(shifted, "t"), Fails(Code::kInvalidArgument, "unaligned"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_sections()->RemoveLast(); })),
              Fails(Code::kInvalidArgument, "1 sections instead of 2"));
  EXPECT_THAT(Open(Changed([](Manifest& m) {
                m.mutable_report()
                    ->mutable_correspondences(0)
                    ->mutable_correspondence()
                    ->mutable_source()
                    ->RemoveLast();
              })),
              Fails(Code::kInvalidArgument, "not four numbers"));
  EXPECT_THAT(Open(Changed([](Manifest& m) { m.mutable_sections(0)->set_element_bytes(8); })),
              Fails(Code::kInvalidArgument, "section displacement"));
}

}  // namespace
}  // namespace liquidblend::store::target_file_test
