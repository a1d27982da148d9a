#include "worker/ingest/read_animation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/animation.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "worker/ingest/read_directory.h"

namespace liquidblend::ingest::read_animation_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kVoxelSizeM = 0.4;  // times 2.5: a velocity scale of 1
const ImportOptions kAllUnits = {
    .frames_per_second = 24, .vertex_scale = 1, .velocity_scale = 1, .voxel_size_m = kVoxelSizeM};

absl::StatusOr<mesh::Animation> Read(const std::vector<LoadedFile>& files,
                                     const ImportOptions& options = kAllUnits,
                                     int num_threads = 2) {
  const parallel::Arena arena(num_threads);
  return ReadAnimation("test", Views(files), options, arena);
}

std::string Error(const std::vector<LoadedFile>& files,
                  const ImportOptions& options = {.voxel_size_m = kVoxelSizeM}) {
  const absl::StatusOr<mesh::Animation> animation = Read(files, options);
  return animation.ok() ? "no error" : std::string(animation.status().message());
}

mesh::Animation SmallAnimation() {
  return synthetic::MovingSphere({.num_frames = 4, .subdivisions = 1});
}

// An animation that holds `frame` at frame number 2, between two good ones.
std::vector<LoadedFile> FilesWith(const mesh::TriangleMesh& frame, Format format = Format::kPly) {
  mesh::Animation animation = SmallAnimation();
  animation.frames.resize(3);
  for (mesh::TriangleMesh& good : animation.frames) {
    if (frame.velocities.cols() == 0) good.velocities.resize(3, 0);
  }
  animation.frames[1] = frame;
  return Files(animation, format);
}

std::vector<LoadedFile> Without(std::vector<LoadedFile> files, const std::string& name) {
  std::erase_if(files, [&](const LoadedFile& file) { return file.name == name; });
  return files;
}

TEST(ReadAnimation, GivesBackWhatEachFormatHolds) {
  const mesh::Animation written = SmallAnimation();
  for (const Format format : {Format::kMantaflow, Format::kPly, Format::kObj}) {
    const absl::StatusOr<mesh::Animation> read = Read(Files(written, format));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->name, "test");
    EXPECT_EQ(read->frames_per_second, 24.0);
    ASSERT_EQ(read->num_frames(), written.num_frames());
    for (int k = 0; k < read->num_frames(); ++k) {
      EXPECT_EQ(read->frames[k].vertices, written.frames[k].vertices);
      EXPECT_EQ(read->frames[k].triangles, written.frames[k].triangles);
      if (format == Format::kObj) {
        EXPECT_EQ(read->frames[k].velocities.cols(), 0);
      } else {
        EXPECT_EQ(read->frames[k].velocities, written.frames[k].velocities);
      }
    }
    EXPECT_THAT(read->notes, IsEmpty());
  }
}

// Two sequences in one folder, and velocities of both.
TEST(ReadAnimation, APatternChoosesFramesAndTheirVelocities) {
  const mesh::Animation written = SmallAnimation();
  std::vector<LoadedFile> files = Files(written, Format::kMantaflow, 1);
  for (LoadedFile& other : Files(written, Format::kPly, 3)) {
    other.name = "foam_" + other.name;
    files.push_back(std::move(other));
  }
  ImportOptions options = kAllUnits;
  options.pattern = "*_000[12].bobj.gz";
  const absl::StatusOr<mesh::Animation> read = Read(files, options);
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->num_frames(), 2);
  EXPECT_EQ(read->frames[1].velocities, written.frames[1].velocities);
  options.pattern = "foam_*";
  EXPECT_EQ(Read(files, options)->first_frame_number, 3);
  options.pattern = "liquid.*";
  EXPECT_THAT(Error(files, options), HasSubstr("(.bobj.gz, .ply, .obj, .stl or .vdb) called "
                                               "'liquid.*' (* stands for any characters"));
}

TEST(ReadAnimation, OrdersFramesByNumberFromAnyFirstOne) {
  mesh::Animation written = SmallAnimation();
  std::vector<LoadedFile> files = Files(written, Format::kPly, 0);
  EXPECT_EQ(Read(files)->first_frame_number, 0);
  files = Files(written, Format::kPly, 9998);  // 9998 to 10001: the names do not sort
  std::reverse(files.begin(), files.end());
  const absl::StatusOr<mesh::Animation> read = Read(files);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->first_frame_number, 9998);
  EXPECT_EQ(read->frames[0].vertices, written.frames[0].vertices);
  EXPECT_EQ(read->frames[3].vertices, written.frames[3].vertices);
}

TEST(ReadAnimation, GoesOnAcrossGapsThatAreAllowed) {
  const std::vector<LoadedFile> files =
      Without(Files(SmallAnimation(), Format::kPly, 7), "mesh_0008.ply");
  const absl::StatusOr<mesh::Animation> read = Read(
      files, {.frames_per_second = 24, .vertex_scale = 1, .velocity_scale = 1, .allow_gaps = true});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->first_frame_number, 7);
  EXPECT_THAT(read->times, ElementsAre(0, 2, 3));
  EXPECT_EQ(read->frames[1].vertices, SmallAnimation().frames[2].vertices);
  EXPECT_THAT(read->notes, ElementsAre("Frame numbers that are missing: 1, the first is 8; time "
                                       "goes on across them."));
}

TEST(ReadAnimation, RefusesWhatIsTooFarAwayForFloats) {
  mesh::Animation animation = SmallAnimation();
  animation.frames[2].vertices.array() += 1000.0F;
  EXPECT_TRUE(Read(Files(animation, Format::kObj)).ok());
  animation.frames[2].vertices.array() += 2e6F;
  EXPECT_THAT(Error(Files(animation, Format::kObj)),
              HasSubstr("frame 2: a coordinate of 2.001e+06 m is beyond 1e+06 mean edge lengths"));
}

TEST(ReadAnimation, HasNoTimesOfItsOwnWithoutGaps) {
  const absl::StatusOr<mesh::Animation> read =
      Read(Files(SmallAnimation(), Format::kPly), {.allow_gaps = true});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->times, IsEmpty());
  EXPECT_THAT(Read(Files(SmallAnimation(), Format::kPly), {.frame_times = {0, 1, 2, 3}})->times,
              IsEmpty());
}

std::vector<LoadedFile> Renamed(const std::vector<std::string>& names) {
  std::vector<LoadedFile> files = Files(SmallAnimation(), Format::kPly);
  for (size_t k = 0; k < names.size(); ++k) files[k].name = names[k];
  files.resize(names.size());
  return files;
}

TEST(ReadAnimation, TakesSamplesBetweenFramesFromTheirNames) {
  absl::StatusOr<mesh::Animation> read =
      Read(Renamed({"l_0012.ply", "l_0012.25.ply", "l_0012.50.ply", "l_0014.ply"}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->times, ElementsAre(0, 0.25, 0.5, 2));
  EXPECT_EQ(read->first_frame_number, 12);
  read = Read(Renamed({"l_1.0.ply", "l_2.5.ply", "l_10.0.ply"}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->times, ElementsAre(0, 1.5, 9));
}

TEST(ReadAnimation, TakesDigitsBeforeTheDotThatAreAlwaysTheSameForAName) {
  const absl::StatusOr<mesh::Animation> read =
      Read(Renamed({"run2.0009.ply", "run2.0010.ply", "run2.0011.ply"}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->first_frame_number, 9);
  EXPECT_THAT(read->times, IsEmpty());
}

TEST(ReadAnimation, TakesTimesFromOptionsOverMetaOverNames) {
  std::vector<LoadedFile> files = Renamed({"a_1.ply", "a_2.ply", "a_9.ply"});
  files.push_back({"meta.json", ToBytes(R"({"frame_times": [0, 0.5, 3]})")});
  EXPECT_THAT(Read(files)->times, ElementsAre(0, 0.5, 3));
  EXPECT_THAT(Read(files, {.frame_times = {0, 2, 4}})->times, ElementsAre(0, 2, 4));
}

TEST(ReadAnimation, IgnoresFilesThatAreNoFrames) {
  std::vector<LoadedFile> files = Files(SmallAnimation(), Format::kMantaflow);
  files.push_back({"liquid_0001.png", ToBytes("not a picture")});
  files.push_back({"pp_0001.uni", ToBytes("particles")});
  EXPECT_TRUE(Read(files).ok());
  EXPECT_FALSE(IsInputName("liquid_0001.png"));
  EXPECT_FALSE(IsInputName("pp_0001.uni"));
  EXPECT_TRUE(IsInputName("lVelMesh_0001.uni"));
  EXPECT_TRUE(IsInputName("meta.json"));
  EXPECT_TRUE(IsInputName("0001.OBJ"));
}

TEST(ReadAnimation, TakesUnitsFromMetaAndOptionsOverIt) {
  const mesh::Animation written = SmallAnimation();
  std::vector<LoadedFile> files = Files(written, Format::kMantaflow);
  files.push_back({"meta.json", ToBytes(R"({"fps": 30, "domain_size_m": [2, 4, 3],
                                            "voxel_size_m": 0.8, "about": [null]})")});
  absl::StatusOr<mesh::Animation> read = Read(files, ImportOptions());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->frames_per_second, 30.0);
  EXPECT_EQ(read->frames[0].vertices, 4 * written.frames[0].vertices);
  EXPECT_EQ(read->frames[0].velocities, 2 * written.frames[0].velocities);  // 0.8 m * 2.5 / s

  files.back().bytes = ToBytes(R"({"domain_size_m": [2, 4, 3], "voxel_size_m": 0.8,
      "units": {"vertex_scale": 0.5, "velocity_scale_to_m_per_s": 8}})");
  read = Read(files, ImportOptions());
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->frames[0].vertices, 0.5 * written.frames[0].vertices);
  EXPECT_EQ(read->frames[0].velocities, 8 * written.frames[0].velocities);

  read = Read(files, {.frames_per_second = 60, .vertex_scale = 2, .velocity_scale = 16});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->frames_per_second, 60.0);
  EXPECT_EQ(read->frames[0].vertices, 2 * written.frames[0].vertices);
  EXPECT_EQ(read->frames[0].velocities, 16 * written.frames[0].velocities);
}

TEST(ReadAnimation, TakesWhatIsUpFromMetaAndOptionsOverIt) {
  std::vector<LoadedFile> files = Files(SmallAnimation(), Format::kMantaflow);
  EXPECT_EQ(Read(files)->up, mesh::Up::kUnknown);
  files.push_back({"meta.json", ToBytes(R"({"up": "-y"})")});
  EXPECT_EQ(Read(files)->up, mesh::Up::kMinusY);
  ImportOptions options = {.voxel_size_m = kVoxelSizeM};
  options.up = mesh::Up::kX;
  EXPECT_EQ(Read(files, options)->up, mesh::Up::kX);
}

TEST(ReadAnimation, ScalesPlyVelocitiesLikePositions) {
  const mesh::Animation written = SmallAnimation();
  const auto read = Read(Files(written, Format::kPly), {.vertex_scale = 2});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->frames[0].velocities, 2 * written.frames[0].velocities);
}

TEST(ReadAnimation, GivesTheSameBytesForAnyThreadCount) {
  const mesh::Animation written = synthetic::FallingDrop({.num_frames = 6});
  const std::vector<LoadedFile> files = Files(written, Format::kPly);
  const absl::StatusOr<mesh::Animation> one = Read(files, {}, 1);
  ASSERT_TRUE(one.ok()) << one.status();
  for (const int num_threads : {2, 8}) {
    const absl::StatusOr<mesh::Animation> more = Read(files, {}, num_threads);
    ASSERT_TRUE(more.ok()) << more.status();
    EXPECT_EQ(more->notes, one->notes);
    for (int k = 0; k < one->num_frames(); ++k) {
      EXPECT_EQ(more->frames[k].vertices, one->frames[k].vertices);
      EXPECT_EQ(more->frames[k].triangles, one->frames[k].triangles);
      EXPECT_EQ(more->frames[k].velocities, one->frames[k].velocities);
    }
  }
}

TEST(ReadAnimation, ReportsProgressThatRisesToOne) {
  const std::vector<LoadedFile> files = Files(SmallAnimation(), Format::kPly);
  std::vector<double> shares;
  const parallel::Arena arena(4);
  ASSERT_TRUE(ReadAnimation("test", Views(files), {}, arena, [&](double share) {
                shares.push_back(share);
              }).ok());
  EXPECT_THAT(shares, ElementsAre(0.25, 0.5, 0.75, 1.0));
}

TEST(ReadAnimation, AllowsFramesThatTheLiquidHasLeft) {
  for (const Format format : {Format::kMantaflow, Format::kPly, Format::kObj, Format::kStl}) {
    const absl::StatusOr<mesh::Animation> read = Read(FilesWith({}, format));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->frames[1].num_vertices(), 0);
    EXPECT_EQ(read->frames[1].num_triangles(), 0);
  }
  EXPECT_EQ(Error({{"a_1.obj", ToBytes("# nothing")}}), "no frame has a triangle");
}

TEST(ReadAnimation, KeepsEnclosedBubbles) {
  const mesh::TriangleMesh bubble = synthetic::BallWithBubble({0, 0, 0}, 1.0, 0.5, 2);
  const absl::StatusOr<mesh::Animation> read = Read(FilesWith(bubble));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(mesh::NumComponents(read->frames[1]), 2);
  EXPECT_THAT(read->notes, IsEmpty());
}

TEST(ReadAnimation, TurnsPartsThatAreInsideOutAndSaysSo) {
  const mesh::TriangleMesh pool = synthetic::Box({-1, -1, -1}, {1, 1, 0}, 4);
  const mesh::TriangleMesh drop = synthetic::Box({0, 0, 1}, {0.5, 0.5, 1.5}, 2);
  const absl::StatusOr<mesh::Animation> read =
      Read(FilesWith(synthetic::Join(std::array{pool, synthetic::Flipped(drop)})));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_DOUBLE_EQ(mesh::Volume(read->frames[1]), 4.125);
  EXPECT_THAT(read->notes, ElementsAre("Turned 1 parts outward that were inside out, in 1 of 3 "
                                       "frames, first in frame 2 at (0, 0, 1) m."));
}

TEST(ReadAnimation, WeldsSoupsAndSaysSo) {
  const mesh::TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 1.0, 1);
  const absl::StatusOr<mesh::Animation> read = Read(FilesWith(synthetic::Soup(ball)));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->frames[1].num_vertices(), ball.num_vertices());
  EXPECT_TRUE(mesh::CheckClosed(read->frames[1]).closed());
  EXPECT_NEAR(mesh::Volume(read->frames[1]), mesh::Volume(ball), 1e-6);
  EXPECT_THAT(read->notes,
              ElementsAre("Welded 198 vertices of open edges that lay on others, in 1 of 3 frames, "
                          "first in frame 2.",
                          "Dropped 198 vertices that no triangle uses any more, in 1 of 3 frames, "
                          "first in frame 2."));
}

TEST(ReadAnimation, SplitsPinchedVerticesAndSaysSo) {
  // Two boxes that share a corner vertex.
  mesh::TriangleMesh boxes = synthetic::Join(
      std::array{synthetic::Box({0, 0, 0}, {1, 1, 1}), synthetic::Box({1, 1, 1}, {2, 2, 2})});
  int shared = -1;
  int doubled = -1;
  for (int v = 0; v < boxes.num_vertices(); ++v) {
    if (boxes.vertices.col(v) == Eigen::Vector3f(1, 1, 1)) (shared < 0 ? shared : doubled) = v;
  }
  for (int& v : boxes.triangles.reshaped()) v = v == doubled ? shared : v;
  const absl::StatusOr<mesh::Animation> read = Read(FilesWith(boxes));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->frames[1].num_vertices(), 16);
  EXPECT_EQ(mesh::NumComponents(read->frames[1]), 2);
  EXPECT_EQ(read->notes[0],
            "Split pinched vertices into 1 more, in 1 of 3 frames, first in frame 2.");
}

TEST(ReadAnimation, TakesPartsThatTouchAnEdgeApartAndSaysSo) {
  const synthetic::Voxels voxels = synthetic::RandomVoxels(6, 0.5, 1);
  const mesh::TriangleMesh written = synthetic::VoxelSurface(voxels);
  const int64_t num_non_manifold = mesh::CheckClosed(written).num_non_manifold_edges;
  ASSERT_GT(num_non_manifold, 10);
  for (const Format format : {Format::kMantaflow, Format::kPly, Format::kObj, Format::kStl}) {
    const absl::StatusOr<mesh::Animation> read = Read(FilesWith(written, format));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(mesh::CheckClosed(read->frames[1]).num_non_manifold_edges, 0);
    EXPECT_TRUE(mesh::CheckClosed(read->frames[1]).closed());
    EXPECT_NEAR(mesh::Volume(read->frames[1]), mesh::Volume(written), 1e-6);
    EXPECT_THAT(read->notes,
                Contains("Took the surface apart at " + std::to_string(num_non_manifold) +
                         " edges with four triangles or more, where parts of it touch, in 1 of 3 "
                         "frames, first in frame 2."));
  }
}

struct Refusal {
  std::string name;
  std::vector<LoadedFile> files;
  std::string message;  // a part of it
  ImportOptions options = {.voxel_size_m = kVoxelSizeM};
};

void PrintTo(const Refusal& refusal, std::ostream* out) { *out << refusal.name; }

mesh::TriangleMesh Ball() { return SmallAnimation().frames[1]; }

template <typename Change>
std::vector<LoadedFile> Changed(Change change, Format format = Format::kPly) {
  mesh::TriangleMesh frame = Ball();
  change(frame);
  return FilesWith(frame, format);
}

std::vector<Refusal> MeshRefusals() {
  const std::string frame = "frame 2, mesh_0002.ply: ";
  return {
      {"Open", Changed([](auto& m) { m.triangles.conservativeResize(3, 79); }),
       frame + "edge (23, 30) has only 1 triangle: the surface is open there"},
      {"OpenPlaceAndHoles", Changed([](auto& m) { m.triangles.conservativeResize(3, 79); }),
       "m, vertices counted from 0); 1 hole with 3 open edges in all; fill them before"},
      {"OpenObj", Changed([](auto& m) { m.triangles.conservativeResize(3, 79); }, Format::kObj),
       "frame 2, mesh_0002.obj: edge (24, 31) has only 1 triangle"},
      {"Overfull", Changed([](auto& m) {
         m.triangles.conservativeResize(3, 81);
         m.triangles.col(80) = m.triangles.col(0);
       }),
       frame + "edge (0, 12) has 3 triangles, of which 2 run from 0 to 12: an edge of a closed "
               "surface has as many as run back"},
      {"OverfullAndEven", Changed([](auto& m) {
         m.triangles.conservativeResize(3, 82);
         m.triangles.col(80) = m.triangles.col(81) = m.triangles.col(0);
       }),
       frame + "edge (0, 12) has 4 triangles, of which 3 run from 0 to 12: "},
      {"TooManyTrianglesAVertex", Changed([](auto& m) {
         const Eigen::Matrix3Xi once = m.triangles;
         m.triangles = once.replicate(1, 9).eval();
       }),
       frame + "720 triangles on 42 vertices, more than 16 a vertex"},
      {"Misoriented", Changed([](auto& m) { m.triangles.col(7).reverseInPlace(); }),
       "is run through twice in one direction"},
      {"InsideOut", Changed([](auto& m) { m = synthetic::Flipped(m); }),
       frame + "the signed volume is -0.4"},
      {"NotFinite",
       Changed([](auto& m) { m.vertices(2, 5) = std::numeric_limits<float>::quiet_NaN(); }),
       frame + "vertex 5: position z is nan"},
      {"TooFarAwayInAFormatThatCountsFromOne",
       Changed([](auto& m) { m.vertices(1, 6) = 2e9f; }, Format::kObj),
       "vertex 7: a position of 2e+09 m is beyond 1e+09"},
      {"InfiniteVelocity",
       Changed([](auto& m) { m.velocities(0, 4) = std::numeric_limits<float>::infinity(); }),
       frame + "vertex 4: velocity x is inf"},
      {"TooFarAway", Changed([](auto& m) { m.vertices(1, 6) = 2e9f; }),
       frame + "vertex 6: a position of 2e+09 m is beyond 1e+09"},
      {"IndexTooLarge", Changed([](auto& m) { m.triangles(1, 3) = 42; }),
       frame + "face 3: vertex 42 is not in [0, 42)"},
      {"IndexNegative", Changed([](auto& m) { m.triangles(1, 3) = -1; }, Format::kMantaflow),
       "frame 2, fluid_mesh_0002.bobj.gz: triangle 3: vertex -1 is not in [0, 42)"},
      {"NoTriangles", Changed([](auto& m) { m.triangles.resize(3, 0); }),
       frame + "42 vertices but no triangle"},
      {"NoVelocitiesInOneFrame",
       [] {
         mesh::Animation animation = SmallAnimation();
         animation.frames[2].velocities.resize(3, 0);
         return Files(animation, Format::kPly);
       }(),
       "frame 3, mesh_0003.ply: no velocities, but frame 1 has them"},
  };
}

// The files with one more, or with another content of one.
std::vector<LoadedFile> With(std::vector<LoadedFile> files, const std::string& name, Bytes bytes) {
  std::erase_if(files, [&](const LoadedFile& file) { return file.name == name; });
  files.push_back({name, std::move(bytes)});
  return files;
}

std::vector<Refusal> FileRefusals() {
  const std::vector<LoadedFile> ply = Files(SmallAnimation(), Format::kPly);
  return {
      {"None", {}, "none of the 0 files is a frame"},
      {"OtherFormatAsked", ply, "none of the 4 files is a frame (.obj)", {.format = Format::kObj}},
      {"SeveralFormats", With(ply, "x_0001.obj", ToBytes("#")),
       "files of several formats, mesh_0001.ply and x_0001.obj"},
      {"NoNumber", With(ply, "mesh.ply", ToBytes("ply")), "mesh.ply: no frame number"},
      {"NumberTooLong", With(ply, "mesh_1234567890.ply", ToBytes("ply")),
       "mesh_1234567890.ply: no frame number of 1 to 9 digits"},
      {"UnprintableName", With(ply, "a\nb.ply", ToBytes("ply")), "a\\nb.ply: no frame number"},
      {"Empty", With(ply, "mesh_0002.ply", {}), "frame 2, mesh_0002.ply: the file is empty"},
  };
}

std::vector<Refusal> NumberRefusals() {
  const std::vector<LoadedFile> ply = Files(SmallAnimation(), Format::kPly);
  return {
      {"MissingNumber", Without(ply, "mesh_0003.ply"),
       "frame 3 is missing: mesh_0004.ply comes right after mesh_0002.ply (allow gaps, "
       "--allow-gaps, to go on without it)"},
      {"NumbersWithALongGap",
       With(Without(ply, "mesh_0004.ply"), "mesh_000000254.ply", ToBytes("ply")),
       "frames 3 and 254 are more than 250 frames apart: mesh_0003.ply and mesh_000000254.ply",
       {.allow_gaps = true}},
      {"NumbersTooFarApart",
       With(Without(ply, "mesh_0004.ply"), "mesh_999999999.ply", ToBytes("ply")),
       "frame 999999999 comes more than 100000 frames after frame 1: mesh_999999999.ply",
       {.allow_gaps = true}},
      {"TimesTooClose",
       With(With({}, "run1.0001.ply", ToBytes("ply")), "run2.0001.ply", ToBytes("ply")),
       "frame 1.0001, run1.0001.ply"},
      {"FractionsTooClose",
       With(With({}, "a_1.ply", ToBytes("ply")), "a_1.0001.ply", ToBytes("ply")),
       "frames 1 and 1.0001 are less than 0.001 frames apart: a_1.ply and a_1.0001.ply"},
      {"FractionTwice",
       With(With(With({}, "a_1.5.ply", ToBytes("ply")), "a_1.50.ply", ToBytes("ply")), "a_2.ply",
            ToBytes("ply")),
       "frame 1.5 is there twice: a_1.5.ply and a_1.50.ply"},
      {"NumberTwice", With(ply, "mesh_003.ply", ToBytes("ply")),
       "frame 3 is there twice: mesh_0003.ply and mesh_003.ply"},
  };
}

std::vector<Refusal> TimeRefusals() {
  const std::vector<LoadedFile> ply = Files(SmallAnimation(), Format::kPly);
  return {
      {"TimesTooFew", ply, "frame_times has 2 times for 4 frames", {.frame_times = {0, 1}}},
      {"TimesNotFromZero",
       ply,
       "frame_times[0] is 1, but times begin with 0",
       {.frame_times = {1, 2, 3, 4}}},
      {"TimesFalling",
       ply,
       "frame_times[2] is 1, not above 2 by 0.001",
       {.frame_times = {0, 2, 1, 4}}},
      {"TimesNotFinite",
       ply,
       "frame_times[1] is nan, not a time",
       {.frame_times = {0, std::numeric_limits<double>::quiet_NaN(), 1, 4}}},
      {"TimesTooFarApart",
       ply,
       "frame_times[3] is 1000000000, not a time up to 100000",
       {.frame_times = {0, 1, 2, 1e9}}},
      {"TimesWithALongGap",
       ply,
       "frame_times[2] is 251.5, more than 250 above 1",
       {.frame_times = {0, 1, 251.5, 252}}},
  };
}

std::vector<Refusal> VelocityRefusals() {
  const std::vector<LoadedFile> manta = Files(SmallAnimation(), Format::kMantaflow);
  const Eigen::Matrix3Xf few = Eigen::Matrix3Xf::Zero(3, 5);
  return {
      {"VelocitiesInAGap",
       Without(manta, "fluid_mesh_0003.bobj.gz"),
       "frame 3: lVelMesh_0003.uni has no mesh",
       {.voxel_size_m = kVoxelSizeM, .allow_gaps = true}},
      {"VelocitiesMissing", Without(manta, "lVelMesh_0003.uni"),
       "frame 3: fluid_mesh_0003.bobj.gz has no velocities, but other frames have"},
      {"VelocitiesWithoutMesh", With(manta, "lVelMesh_0009.uni", Gzip(RawUni(few))),
       "frame 9: lVelMesh_0009.uni has no mesh"},
      {"WrongNumberOfVelocities", With(manta, "lVelMesh_0003.uni", Gzip(RawUni(few))),
       "frame 3, lVelMesh_0003.uni: 5 velocities for the 42 vertices of the frame's mesh"},
      {"VelocityUnitUnknown", manta, "give voxel_size_m or velocity_scale", {}},
  };
}

std::vector<Refusal> MetaRefusals() {
  const std::vector<LoadedFile> ply = Files(SmallAnimation(), Format::kPly);
  return {
      {"MetaTimes", With(ply, "meta.json", ToBytes("{\"frame_times\": [0, \"1\"]}")),
       "meta.json: frame_times[1] is \"1\", not a number"},
      {"MetaTimesFalling", With(ply, "meta.json", ToBytes("{\"frame_times\": [0, 2, 2, 3]}")),
       "meta.json: frame_times[2] is 2, not above 2"},
      {"MetaTimesNoArray", With(ply, "meta.json", ToBytes("{\"frame_times\": 3}")),
       "meta.json: frame_times is \"3\", not an array of numbers"},
      {"MetaNoJson", With(ply, "meta.json", ToBytes("{\"fps\": ")),
       "meta.json: the file is not a JSON object"},
      {"MetaWrongType", With(ply, "meta.json", ToBytes("{\"fps\": \"24\"}")),
       "meta.json: fps is \"24\", not a number above 0"},
      {"MetaFrameRate", With(ply, "meta.json", ToBytes("{\"fps\": 1e10}")),
       "meta.json: fps is 1e+10, not in [0.001, 1e+06]"},
      {"MetaDomain", With(ply, "meta.json", ToBytes("{\"domain_size_m\": [1, -2, 3]}")),
       "meta.json: domain_size_m is \"-2\""},
      {"MetaUnits", With(ply, "meta.json", ToBytes("{\"units\": {\"vertex_scale\": 0}}")),
       "meta.json: vertex_scale is \"0\""},
      {"MetaUp", With(ply, "meta.json", ToBytes("{\"up\": \"upwards\"}")),
       "meta.json: up is \"upwards\", not x, y, z, -x, -y or -z"},
      {"MetaUpNumber", With(ply, "meta.json", ToBytes("{\"up\": 2}")),
       "meta.json: up is \"2\", not x, y, z, -x, -y or -z"},
  };
}

std::vector<Refusal> OptionRefusals() {
  const std::vector<LoadedFile> ply = Files(SmallAnimation(), Format::kPly);
  return {
      {"OptionNegative", ply, "vertex_scale is -1", {.vertex_scale = -1}},
      {"OptionFrameRate",
       ply,
       "frames_per_second is 1e-10, not in [0.001, 1e+06]",
       {.frames_per_second = 1e-10}},
      {"OptionNotFinite",
       ply,
       "frames_per_second is inf",
       {.frames_per_second = std::numeric_limits<double>::infinity()}},
  };
}

class Refusals : public testing::TestWithParam<Refusal> {};

TEST_P(Refusals, NameFileFrameAndElement) {
  EXPECT_THAT(Error(GetParam().files, GetParam().options), HasSubstr(GetParam().message));
}

const auto kRefusalName = [](const auto& param) { return param.param.name; };
INSTANTIATE_TEST_SUITE_P(Mesh, Refusals, testing::ValuesIn(MeshRefusals()), kRefusalName);
INSTANTIATE_TEST_SUITE_P(Files, Refusals, testing::ValuesIn(FileRefusals()), kRefusalName);
INSTANTIATE_TEST_SUITE_P(Numbers, Refusals, testing::ValuesIn(NumberRefusals()), kRefusalName);
INSTANTIATE_TEST_SUITE_P(Times, Refusals, testing::ValuesIn(TimeRefusals()), kRefusalName);
INSTANTIATE_TEST_SUITE_P(Velocities, Refusals, testing::ValuesIn(VelocityRefusals()), kRefusalName);
INSTANTIATE_TEST_SUITE_P(Meta, Refusals, testing::ValuesIn(MetaRefusals()), kRefusalName);
INSTANTIATE_TEST_SUITE_P(Options, Refusals, testing::ValuesIn(OptionRefusals()), kRefusalName);

TEST(ReadAnimation, ReportsTheLowestFrameAtFaultAtAnyThreadCount) {
  mesh::Animation animation = synthetic::MovingSphere({.num_frames = 24, .subdivisions = 1});
  for (const int k : {5, 11, 23}) animation.frames[k].triangles(0, 0) = 99;
  const std::vector<LoadedFile> files = Files(animation, Format::kPly);
  for (const int num_threads : {1, 2, 8}) {
    const absl::StatusOr<mesh::Animation> read = Read(files, {}, num_threads);
    ASSERT_FALSE(read.ok());
    EXPECT_EQ(read.status().message(),
              "frame 6, mesh_0006.ply: face 0: vertex 99 is not in [0, 42)");
  }
}

}  // namespace
}  // namespace liquidblend::ingest::read_animation_test
