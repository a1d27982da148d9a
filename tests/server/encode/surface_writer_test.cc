#include "server/encode/surface_writer.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <utility>

#include "server/blend/blend.h"
#include "server/encode/draco.h"
#include "server/encode/libdraco.h"
#include "server/slice/slice.h"
#include "tests/server/encode/encode_testing.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"

namespace liquidblend::encode {
namespace {

using mesh::TriangleMesh;

constexpr std::array<Preset, 2> kOwnPresets = {Preset::kFastest, Preset::kBalanced};

std::string Written(const TriangleMesh& mesh, const DracoOptions& options, SurfaceWriter& writer) {
  const absl::StatusOr<std::string> data = EncodeDraco(mesh, options, writer);
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
  std::vector<mesh::Float4> positions;
  SurfaceWriter writer;
  int num_identical = 0;
  int num_slices = 0;
  for (const auto& weights : std::vector<std::vector<double>>{{0, 0}, {1, 0}, {0.5, 0.5}, {0, 1}}) {
    for (double time_s = 0.01; time_s < 0.29; time_s += 0.03) {
      ASSERT_TRUE(slice::FindCandidates(index, weights, time_s, workspace).ok());
      blend::BlendVertices(family, weights, workspace.vertex_ranges, positions);
      const TriangleMesh surface = slice::March(index, positions, workspace);
      for (const Preset preset : kOwnPresets) {
        DracoOptions options = OptionsWith(14);
        options.preset = preset;
        const std::string data = Written(surface, options, writer);
        const std::string judge = ByLibdraco(surface, options);
        ASSERT_EQ(NodesOf(Decode(data), options), NodesOf(Decode(judge), options));
        if (mesh::CheckClosed(surface).num_crowded_edges == 0) {
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

// A closed mesh whose edges are turned at random: triangles a, b, c and b, a, d become a, d, c and
// d, b, c. Vertices may get any valence from 2 on, edges any even number of triangles.
class RandomSurface {
 public:
  explicit RandomSurface(uint32_t seed) : random_(seed) {
    const auto subdivisions = static_cast<int>(random_() % 4);
    mesh_ = random_() % 2 == 0 ? synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, subdivisions)
                               : synthetic::Torus(Eigen::Vector3f::Zero(), 1.0, 0.5,
                                                  static_cast<int>(3 + random_() % 20),
                                                  static_cast<int>(3 + random_() % 20));
    for (float& x : mesh_.vertices.reshaped()) x = static_cast<float>(random_() % 1024);
  }

  void TurnEdges(int count) {
    for (; count > 0; --count) TurnEdge(AnyTriangle(), static_cast<int>(random_() % 3));
  }

  // Two vertices become one: surfaces touch, edges between them are lost.
  void MergeVertices(int count) {
    for (; count > 0; --count) {
      const int from = AnyVertex(), to = AnyVertex();
      mesh_.triangles = (mesh_.triangles.array() == from).select(to, mesh_.triangles);
    }
  }

  void DropTriangles(int count) {
    for (; count > 0; --count) mesh_.triangles.col(AnyTriangle()).setConstant(0);
  }

  const TriangleMesh& mesh() const { return mesh_; }

 private:
  int AnyTriangle() { return static_cast<int>(random_() % mesh_.num_triangles()); }
  int AnyVertex() { return static_cast<int>(random_() % mesh_.num_vertices()); }

  void TurnEdge(int triangle, int k) {
    const int a = mesh_.triangles(k, triangle), b = mesh_.triangles((k + 1) % 3, triangle);
    const int c = mesh_.triangles((k + 2) % 3, triangle);
    for (int other = 0; other < mesh_.num_triangles(); ++other) {
      for (int j = 0; j < 3; ++j) {
        if (mesh_.triangles(j, other) != b || mesh_.triangles((j + 1) % 3, other) != a) continue;
        const int d = mesh_.triangles((j + 2) % 3, other);
        if (d == c) return;
        mesh_.triangles.col(triangle) = Eigen::Vector3i(a, d, c);
        mesh_.triangles.col(other) = Eigen::Vector3i(d, b, c);
        return;
      }
    }
  }

  std::mt19937 random_;
  TriangleMesh mesh_;
};

DracoOptions RandomSurfaceOptions(uint32_t seed) {
  DracoOptions options;
  options.position_bits = 10;
  options.grid.extent_m = 1023.0F;  // nodes at whole numbers
  options.preset = kOwnPresets[seed % 2];
  return options;
}

TriangleMesh WithoutDegenerate(const TriangleMesh& mesh) {
  TriangleMesh out = mesh;
  Eigen::Index num_kept = 0;
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    const Eigen::Vector3i v = mesh.triangles.col(t);
    if (v[0] != v[1] && v[1] != v[2] && v[2] != v[0]) out.triangles.col(num_kept++) = v;
  }
  out.triangles.conservativeResize(Eigen::NoChange, num_kept);
  return out;
}

TEST(SurfaceWriter, WritesRandomClosedSurfaces) {
  SurfaceWriter writer;
  int num_written = 0;
  int num_identical = 0;
  constexpr uint32_t kTrials = 600;
  for (uint32_t seed = 0; seed < kTrials; ++seed) {
    RandomSurface surface(seed);
    const int effort = static_cast<int>(surface.mesh().num_triangles()) / (1 + seed % 7);
    surface.TurnEdges(effort);
    if (seed % 3 == 1) surface.MergeVertices(1 + effort / 30);
    const DracoOptions options = RandomSurfaceOptions(seed);
    const std::string data = Written(surface.mesh(), options, writer);
    ASSERT_EQ(NodesOf(Decode(data), options), NodesOf(WithoutDegenerate(surface.mesh()), options))
        << "seed " << seed;
    const bool is_identical = data == ByLibdraco(surface.mesh(), options);
    num_written += IsWritten(surface.mesh(), options.preset) ? 1 : 0;
    num_identical += is_identical ? 1 : 0;
    if (mesh::CheckClosed(WithoutDegenerate(surface.mesh())).num_crowded_edges == 0) {
      EXPECT_TRUE(is_identical) << "seed " << seed;
    }
  }
  // The others have components of two triangles: turned often enough, small surfaces do.
  EXPECT_GT(num_written, kTrials / 2);
  EXPECT_GT(num_identical, kTrials / 5);
  RecordProperty("num_written", num_written);
  RecordProperty("num_identical", num_identical);
}

TEST(SurfaceWriter, LeavesSurfacesWithHolesToLibdraco) {
  SurfaceWriter writer;
  for (uint32_t seed = 0; seed < 200; ++seed) {
    RandomSurface surface(seed);
    surface.TurnEdges(static_cast<int>(seed % 10));
    surface.DropTriangles(static_cast<int>(1 + seed % 20));
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
    RandomSurface surface(seed);
    surface.TurnEdges(50);
    const DracoOptions options = RandomSurfaceOptions(seed / 2);
    SurfaceWriter fresh;
    EXPECT_TRUE(Written(surface.mesh(), options, used) == Written(surface.mesh(), options, fresh));
  }
}

}  // namespace
}  // namespace liquidblend::encode
