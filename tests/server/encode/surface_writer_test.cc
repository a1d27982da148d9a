#include "server/encode/surface_writer.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/slice/slice.h"
#include "server/encode/draco.h"
#include "server/encode/libdraco.h"
#include "tests/core/parallel/idle_threads.h"
#include "tests/server/encode/encode_testing.h"
#include "tests/server/encode/scrambled_surface.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/voxels.h"

namespace liquidblend::encode::surface_writer_test {
namespace {

using mesh::TriangleMesh;

constexpr std::array<Preset, 2> kOwnPresets = {Preset::kFastest, Preset::kBalanced};

std::string Written(const TriangleMesh& mesh, const DracoOptions& options, SurfaceWriter& writer,
                    parallel::Helpers* helpers = nullptr) {
  const absl::StatusOr<std::string> data = EncodeDraco(mesh, options, writer, helpers);
  EXPECT_TRUE(data.ok()) << data.status();
  return data.ok() ? *data : std::string();
}

std::string ByLibdraco(const TriangleMesh& mesh, const DracoOptions& options) {
  const absl::StatusOr<std::string> data = EncodeWithLibdraco(mesh, options);
  EXPECT_TRUE(data.ok()) << data.status();
  return data.ok() ? *data : std::string();
}

bool IsWritten(const TriangleMesh& mesh, Preset preset) {
  SurfaceWriterOptions options;
  options.method =
      preset == Preset::kFastest ? EdgebreakerMethod::kStandard : EdgebreakerMethod::kValence;
  std::string data;
  return SurfaceWriter().Write(mesh, options, data);
}

TEST(SurfaceWriter, WritesLibdracosBytes) {
  const Eigen::Vector3f zero = Eigen::Vector3f::Zero();
  std::vector<TriangleMesh> shapes;
  for (int subdivisions = 0; subdivisions < 5; ++subdivisions) {
    shapes.push_back(synthetic::Icosphere({0.1F, 0.2F, 0.3F}, 1.0, subdivisions));
  }
  shapes.push_back(synthetic::Box({-1, -1, -1}, {1, 1, 1}, 7));
  shapes.push_back(synthetic::Torus(zero, 1.2, 0.5, 60, 30));
  shapes.push_back(synthetic::Torus(zero, 1.2, 0.5, 3, 3));
  shapes.push_back(synthetic::BallWithBubble(zero, 1.5, 0.7, 3));
  shapes.push_back(synthetic::Join(std::vector<TriangleMesh>(shapes)));
  SurfaceWriter writer;
  for (size_t s = 0; s < shapes.size(); ++s) {
    for (const int bits : {8, 11, 14, 17, 20}) {
      for (const Preset preset : kOwnPresets) {
        DracoOptions options = OptionsWith(bits);
        options.preset = preset;
        EXPECT_TRUE(IsWritten(shapes[s], preset));
        EXPECT_TRUE(Written(shapes[s], options, writer) == ByLibdraco(shapes[s], options))
            << "shape " << s << ", bits " << bits << ", preset " << static_cast<int>(preset);
      }
    }
  }
}

// Slices of a family that folds, with handles, bubbles, droplets and parts that touch.
TEST(SurfaceWriter, WritesWarpedSlices) {
  const mesh::RegisteredFamily family =
      synthetic::MakeFamily(synthetic::HexahedralTorus(40, 20, {.num_frames = 8}),
                            {{synthetic::SmoothWarp(3, 0.4F, 4.0F), nullptr},
                             {synthetic::Noise(4, 0.02F, 1.5F), nullptr}});
  const slice::CellIndex index(family);
  slice::Workspace workspace;
  SurfaceWriter writer;
  int num_identical = 0;
  int num_slices = 0;
  for (const auto& weights : std::vector<std::vector<double>>{{0, 0}, {1, 0}, {0.5, 0.5}, {0, 1}}) {
    for (double time_s = 0.01; time_s < 0.29; time_s += 0.03) {
      const TriangleMesh surface = synthetic::SliceFamily(index, weights, time_s, workspace);
      for (const Preset preset : kOwnPresets) {
        DracoOptions options = OptionsWith(14);
        options.preset = preset;
        const std::string data = Written(surface, options, writer);
        const std::string judge = ByLibdraco(surface, options);
        ASSERT_EQ(NodesOf(Decode(data), options), NodesOf(Decode(judge), options));
        if (mesh::CheckClosed(surface).num_non_manifold_edges == 0) {
          EXPECT_TRUE(data == judge);
        }
        num_identical += data == judge ? 1 : 0;
        ++num_slices;
      }
    }
  }
  EXPECT_GT(num_identical, num_slices / 2);
}

// Cubes that touch in edges and corners, of which libdraco makes surfaces with holes.
TEST(SurfaceWriter, WritesSurfacesThatTouchThemselves) {
  DracoOptions options;
  options.position_bits = 8;
  options.grid.extent_m = 255.0F;  // nodes at whole numbers
  SurfaceWriter writer;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    for (const Preset preset : kOwnPresets) {
      options.preset = preset;
      const auto num_per_side = static_cast<int>(1 + seed % 9);
      const TriangleMesh mesh =
          synthetic::VoxelSurface(synthetic::RandomVoxels(num_per_side, 0.5, seed));
      EXPECT_EQ(IsWritten(mesh, preset), mesh.num_triangles() > 0);
      ASSERT_EQ(NodesOf(Decode(Written(mesh, options, writer)), options), NodesOf(mesh, options))
          << "seed " << seed << ", preset " << static_cast<int>(preset);
    }
  }
}

// A sphere or torus with vertices anywhere on the nodes of a grid.
ScrambledSurface RandomSurface(std::mt19937& random) {
  const auto below = [&](uint32_t end) { return static_cast<int>(random() % end); };
  TriangleMesh mesh = below(2) == 0 ? synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, below(4))
                                    : synthetic::Torus(Eigen::Vector3f::Zero(), 1.0, 0.5,
                                                       3 + below(20), 3 + below(20));
  for (float& x : mesh.vertices.reshaped()) x = static_cast<float>(below(1024));
  return ScrambledSurface(std::move(mesh));
}

void TurnEdges(int count, std::mt19937& random, ScrambledSurface& surface) {
  for (; count > 0; --count) surface.TurnEdge(random(), random());
}

DracoOptions RandomSurfaceOptions(uint32_t seed) {
  DracoOptions options;
  options.position_bits = 10;
  options.grid.extent_m = 1023.0F;  // nodes at whole numbers
  options.preset = kOwnPresets[seed % 2];
  return options;
}

TEST(SurfaceWriter, WritesRandomClosedSurfaces) {
  SurfaceWriter writer;
  int num_written = 0;
  int num_identical = 0;
  constexpr uint32_t kTrials = 600;
  for (uint32_t seed = 0; seed < kTrials; ++seed) {
    std::mt19937 random(seed);
    ScrambledSurface surface = RandomSurface(random);
    const int effort = static_cast<int>(surface.mesh().num_triangles()) / (1 + seed % 7);
    TurnEdges(effort, random, surface);
    const int num_merged = seed % 3 == 1 ? 1 + effort / 30 : 0;
    for (int i = 0; i < num_merged; ++i) surface.MergeVertices(random(), random());
    const DracoOptions options = RandomSurfaceOptions(seed);
    const std::string data = Written(surface.mesh(), options, writer);
    ASSERT_EQ(NodesOf(Decode(data), options), NodesOf(WithoutDegenerate(surface.mesh()), options))
        << "seed " << seed;
    const bool is_identical = data == ByLibdraco(surface.mesh(), options);
    num_written += IsWritten(surface.mesh(), options.preset) ? 1 : 0;
    num_identical += is_identical ? 1 : 0;
    if (mesh::CheckClosed(WithoutDegenerate(surface.mesh())).num_non_manifold_edges == 0) {
      EXPECT_TRUE(is_identical) << "seed " << seed;
    }
  }
  // The others have components of two triangles: turned often enough, small surfaces do.
  EXPECT_GT(num_written, kTrials / 2);
  EXPECT_GT(num_identical, kTrials / 5);
  RecordProperty("num_written", num_written);
  RecordProperty("num_identical", num_identical);
}

// Large ones with vertices of many fans and triangles; the last one has a hole.
TEST(SurfaceWriter, WritesTheSameHoweverManyHelp) {
  std::mt19937 random(1);
  ScrambledSurface surface(synthetic::Torus(Eigen::Vector3f::Zero(), 1.0, 0.5, 200, 150));
  TurnEdges(20'000, random, surface);
  for (int i = 0; i < 300; ++i) surface.MergeVertices(random(), random());
  std::vector<TriangleMesh> surfaces = {
      synthetic::VoxelSurface(synthetic::RandomVoxels(30, 0.5, 7)), surface.mesh()};
  surface.DropTriangle(random());
  surfaces.push_back(surface.mesh());
  SurfaceWriter alone, helped;  // the latter used for few and for many parts
  for (const int num_idle : {3, 1, 2}) {
    parallel::IdleThreads idle(num_idle);
    for (const TriangleMesh& mesh : surfaces) {
      ASSERT_GT(mesh.num_vertices(), 25'000);
      EXPECT_TRUE(Written(mesh, OptionsWith(14), helped, &idle) ==
                  Written(mesh, OptionsWith(14), alone));
    }
    EXPECT_GE(idle.most_tasks, 2 * num_idle);
  }
}

TEST(SurfaceWriter, LeavesSurfacesWithHolesToLibdraco) {
  SurfaceWriter writer;
  for (uint32_t seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    ScrambledSurface surface = RandomSurface(random);
    TurnEdges(static_cast<int>(seed % 10), random, surface);
    for (uint32_t i = 0; i < 1 + seed % 20; ++i) surface.DropTriangle(random());
    const DracoOptions options = RandomSurfaceOptions(seed);
    const std::string data = Written(surface.mesh(), options, writer);
    EXPECT_TRUE(data == ByLibdraco(surface.mesh(), options));
    ASSERT_EQ(NodesOf(Decode(data), options), NodesOf(WithoutDegenerate(surface.mesh()), options))
        << "seed " << seed;
  }
}

TEST(SurfaceWriter, RefusesNothingAndTwoTrianglesBackToBack) {
  TriangleMesh mesh;
  mesh.vertices = Eigen::Matrix3f::Identity();
  EXPECT_FALSE(IsWritten(mesh, Preset::kFastest));
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 1, 1, 0, 2, 2;
  EXPECT_TRUE(mesh::CheckClosed(mesh).closed());
  EXPECT_FALSE(IsWritten(mesh, Preset::kFastest));
  EXPECT_FALSE(IsWritten(mesh, Preset::kBalanced));
  EXPECT_EQ(Decode(*EncodeDraco(mesh, OptionsWith(14))).num_triangles(), 2);
}

TEST(SurfaceWriter, GivesTheSameBytesWhateverItWroteBefore) {
  SurfaceWriter used;
  for (uint32_t seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    ScrambledSurface surface = RandomSurface(random);
    TurnEdges(50, random, surface);
    const DracoOptions options = RandomSurfaceOptions(seed / 2);
    SurfaceWriter fresh;
    EXPECT_TRUE(Written(surface.mesh(), options, used) == Written(surface.mesh(), options, fresh));
  }
}

}  // namespace
}  // namespace liquidblend::encode::surface_writer_test
