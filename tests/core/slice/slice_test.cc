#include "core/slice/slice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel/arena.h"
#include "tests/core/parallel/idle_threads.h"
#include "tests/synthetic/families.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/slice_family.h"

namespace liquidblend::slice {
namespace {

using mesh::RegisteredFamily;
using mesh::SpaceTimeMesh;
using mesh::TriangleMesh;

struct Query {
  std::vector<double> weights;
  double time_s = 0.0;
};

TriangleMesh BlendAndSlice(const CellIndex& index, const Query& query) {
  return synthetic::SliceFamily(index, query.weights, query.time_s);
}

bool HasRepeatedVertex(const TriangleMesh& surface) {
  const auto& t = surface.triangles;
  return ((t.row(0).array() == t.row(1).array()) || (t.row(1).array() == t.row(2).array()) ||
          (t.row(2).array() == t.row(0).array()))
      .any();
}

bool UsesEachVertex(const TriangleMesh& surface) {
  std::vector<bool> is_used(surface.num_vertices(), false);
  for (const int v : surface.triangles.reshaped()) is_used[v] = true;
  return std::find(is_used.begin(), is_used.end(), false) == is_used.end();
}

void ExpectSound(const TriangleMesh& surface, const std::string& what) {
  const mesh::ClosednessReport report = mesh::CheckClosed(surface);
  EXPECT_EQ(report.num_odd_edges, 0) << what;
  EXPECT_EQ(report.num_misoriented_edges, 0) << what;
  EXPECT_TRUE(mesh::Validate(surface).ok()) << what << ": " << mesh::Validate(surface);
  EXPECT_FALSE(HasRepeatedVertex(surface)) << what;
  EXPECT_TRUE(UsesEachVertex(surface)) << what;
}

std::string BytesOf(const TriangleMesh& surface) {
  std::string bytes(reinterpret_cast<const char*>(surface.vertices.data()),
                    surface.vertices.size() * sizeof(float));
  return bytes.append(reinterpret_cast<const char*>(surface.triangles.data()),
                      surface.triangles.size() * sizeof(int));
}

struct NamedMesh {
  std::string name;
  SpaceTimeMesh mesh;
};

// Cells with two corners twice, as layers in between make them.
SpaceTimeMesh AsHexahedra(SpaceTimeMesh mesh) {
  for (const mesh::Wedge& w : mesh.wedges) {
    mesh.hexahedra.push_back({w[0], w[3], w[1], w[4], w[0], w[3], w[2], w[5]});
  }
  mesh.wedges.clear();
  return mesh;
}

std::vector<NamedMesh> AllComplexes() {
  synthetic::ComplexOptions options;
  options.velocity_m_per_frame = {0.1F, 0.05F, -0.02F};
  options.growth_per_frame = 0.03F;
  return {{"hexahedral sphere", synthetic::HexahedralSphere(6, options)},
          {"hexahedral torus", synthetic::HexahedralTorus(20, 9, options)},
          {"wedges", synthetic::WedgeSphere(2, options)},
          {"wedges as hexahedra", AsHexahedra(synthetic::WedgeSphere(2, options))},
          {"tetrahedra", synthetic::TetrahedralSphere(2, options)},
          {"all four kinds", synthetic::MixedSphere(6, options)}};
}

// Two targets, so that sums are tested too; the first has an extrapolation of its own.
RegisteredFamily SmoothFamily(SpaceTimeMesh mesh) {
  return synthetic::MakeFamily(std::move(mesh), {{synthetic::SmoothWarp(1, 0.5F, 4.0F),
                                                  synthetic::SmoothWarp(2, 0.3F, 2.0F)},
                                                 {synthetic::SmoothWarp(3, 0.3F, 3.0F), {}}});
}

RegisteredFamily NoisyFamily(SpaceTimeMesh mesh) {
  return synthetic::MakeFamily(std::move(mesh),
                               {{synthetic::Noise(1, 0.5F, 3.0F), synthetic::Noise(2, 0.2F, 2.0F)},
                                {synthetic::Noise(3, 0.1F, 1.0F), {}}});
}

std::vector<Query> RandomQueries(const RegisteredFamily& family, int count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> weight(blend::kMinWeight, blend::kMaxWeight);
  std::uniform_real_distribution<double> time(0.0, family.duration_s());
  std::vector<Query> queries(count);
  for (int q = 0; q < count; ++q) {
    queries[q].weights = {weight(random), weight(random)};
    queries[q].time_s = time(random);
    // Every fourth at a frame, where vertices lie in the hyperplane.
    if (q % 4 == 0) {
      queries[q].time_s =
          std::floor(queries[q].time_s * family.frames_per_second) / family.frames_per_second;
    }
  }
  return queries;
}

// Time edges that run backwards at these weights.
int64_t NumFoldedEdges(const RegisteredFamily& family, const std::vector<double>& weights) {
  std::vector<int32_t> all(family.vertices.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<mesh::Float4> positions(all.size());
  blend::Blender(family, weights).Place(all, positions.data());
  int64_t num_folded = 0;
  for (const mesh::Hexahedron& cell : family.hexahedra) {
    for (int k = 0; k < 4; ++k) num_folded += positions[cell[k]][3] > positions[cell[k + 4]][3];
  }
  return num_folded;
}

TEST(Slice, TheWarpsOfTheseTestsFold) {
  const SpaceTimeMesh mesh = synthetic::HexahedralSphere(6);
  EXPECT_EQ(NumFoldedEdges(SmoothFamily(mesh), {0.0, 0.0}), 0);
  EXPECT_GT(NumFoldedEdges(SmoothFamily(mesh), {1.0, 0.0}), 500);
  EXPECT_GT(NumFoldedEdges(NoisyFamily(mesh), {1.0, 0.0}), 500);
}

TEST(Slice, SyntheticComplexesAreValid) {
  for (const auto& [name, mesh] : AllComplexes()) {
    EXPECT_TRUE(mesh::Validate(mesh).ok()) << name << ": " << mesh::Validate(mesh);
  }
}

TEST(Slice, IsClosedUnderAnySmoothTimeWarp) {
  for (auto& [name, mesh] : AllComplexes()) {
    const RegisteredFamily family = SmoothFamily(std::move(mesh));
    ASSERT_TRUE(mesh::Validate(family).ok());
    const CellIndex index(family);
    for (const Query& query : RandomQueries(family, 200)) {
      const TriangleMesh surface = BlendAndSlice(index, query);
      ExpectSound(surface, name);
      EXPECT_GT(surface.num_triangles(), 100) << name;
    }
  }
}

TEST(Slice, IsClosedUnderNoise) {
  for (auto& [name, mesh] : AllComplexes()) {
    const RegisteredFamily family = NoisyFamily(std::move(mesh));
    const CellIndex index(family);
    for (const Query& query : RandomQueries(family, 200)) {
      const TriangleMesh surface = BlendAndSlice(index, query);
      ExpectSound(surface, name);
      EXPECT_GT(surface.num_triangles(), 0) << name;
    }
  }
}

TEST(Slice, IsClosedAtBothEndsOfTimeAtAnyWeights) {
  for (auto& [name, mesh] : AllComplexes()) {
    const RegisteredFamily family = NoisyFamily(std::move(mesh));
    const CellIndex index(family);
    for (const double w : {-1.0, -0.25, 0.0, 0.5, 1.0, 1.25, 2.0}) {
      for (const double time_s : {0.0, family.duration_s()}) {
        const TriangleMesh surface = BlendAndSlice(index, {{w, -w / 2}, time_s});
        ExpectSound(surface, name);
        EXPECT_GT(surface.num_triangles(), 0) << name;
      }
    }
  }
}

TEST(Slice, IsThereWhenAWarpMovesAllTimesBeyondTheEnds) {
  // The end slabs are held back, so the liquid of the nearer end fills the animation.
  for (auto& [name, mesh] : AllComplexes()) {
    const RegisteredFamily family = synthetic::MakeFamily(
        std::move(mesh),
        {{[](int64_t, const Eigen::Vector4f&) { return Eigen::Vector4f(0, 0, 0, 20); }, {}}});
    const CellIndex index(family);
    for (const double w : {-1.0, 1.0}) {
      for (const double share : {0.0, 0.4, 1.0}) {
        const TriangleMesh surface = BlendAndSlice(index, {{w}, share * family.duration_s()});
        ExpectSound(surface, name);
        EXPECT_GT(surface.num_triangles(), 100) << name << ", weight " << w << ", " << share;
      }
    }
  }
}

// Edges with more than two triangles.
int64_t NumNonManifoldEdges(const TriangleMesh& surface) {
  std::map<std::pair<int, int>, int> num_triangles;
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ++num_triangles[std::minmax<int>(
          {surface.triangles(k, t), surface.triangles((k + 1) % 3, t)})];
    }
  }
  return std::count_if(num_triangles.begin(), num_triangles.end(),
                       [](const auto& edge) { return edge.second > 2; });
}

TEST(Slice, HasTwoTrianglesOnEachEdgeHoweverItFolds) {
  for (auto& [name, mesh] : AllComplexes()) {
    const RegisteredFamily family = NoisyFamily(std::move(mesh));
    const CellIndex index(family);
    for (const Query& query : RandomQueries(family, 20)) {
      const TriangleMesh surface = BlendAndSlice(index, query);
      EXPECT_GT(surface.num_triangles(), 0) << name;
      EXPECT_EQ(NumNonManifoldEdges(surface), 0) << name;
    }
  }
}

TEST(Slice, HasTheSameBytesAtAnyThreadCount) {
  const RegisteredFamily family = SmoothFamily(synthetic::MixedSphere(6));
  const CellIndex index(family);
  const std::vector<Query> queries = RandomQueries(family, 200);
  std::vector<std::string> expected;
  for (const int num_threads : {1, 2, 8}) {
    const parallel::Arena arena(num_threads);
    std::vector<std::string> bytes(queries.size());
    arena.ForChunks(
        static_cast<int64_t>(queries.size()), 10, [&](int64_t, int64_t begin, int64_t end) {
          Workspace workspace;  // used again and again
          for (int64_t q = begin; q < end; ++q) {
            bytes[q] = BytesOf(
                synthetic::SliceFamily(index, queries[q].weights, queries[q].time_s, workspace));
          }
        });
    if (expected.empty()) {
      for (const Query& query : queries) expected.push_back(BytesOf(BlendAndSlice(index, query)));
    }
    EXPECT_EQ(bytes, expected) << num_threads << " threads";
  }
}

TEST(Slice, OfTheSourceAtAFrameIsTheFrameExactly) {
  for (const auto& [name, mesh] : AllComplexes()) {
    const RegisteredFamily family = SmoothFamily(mesh);
    const CellIndex index(family);
    for (int frame = 0; frame < family.num_frames; ++frame) {
      const TriangleMesh surface =
          BlendAndSlice(index, {{0.0, 0.0}, frame / family.frames_per_second});
      std::set<std::array<float, 3>> expected;
      for (const mesh::Float4& v : family.vertices) {
        if (v[3] == static_cast<float>(frame)) expected.insert({v[0], v[1], v[2]});
      }
      std::set<std::array<float, 3>> actual;
      for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
        const Eigen::Vector3f p = surface.vertices.col(v);
        actual.insert({p.x(), p.y(), p.z()});
      }
      EXPECT_EQ(actual, expected) << name << ", frame " << frame;
    }
  }
}

TEST(Slice, IsOrientedOutwardWithTheRightVolume) {
  constexpr double kSphere = 4.0 / 3.0 * std::numbers::pi;
  constexpr double kTorus = 2.0 * std::numbers::pi * std::numbers::pi * 0.7 * 0.3 * 0.3;
  constexpr double kTolerance = 0.04;  // of the polyhedra against the smooth bodies
  synthetic::ComplexOptions options;
  options.velocity_m_per_frame = {0.5F, 0.0F, 0.1F};
  options.growth_per_frame = 0.1F;
  struct Body {
    SpaceTimeMesh mesh;
    double volume;
  };
  for (const Body& body : {Body{synthetic::HexahedralSphere(16, options), kSphere},
                           Body{synthetic::HexahedralTorus(48, 24, options), kTorus},
                           Body{synthetic::WedgeSphere(3, options), kSphere},
                           Body{AsHexahedra(synthetic::WedgeSphere(3, options)), kSphere},
                           Body{synthetic::TetrahedralSphere(3, options), kSphere},
                           Body{synthetic::MixedSphere(16, options), kSphere}}) {
    const RegisteredFamily family = synthetic::MakeFamily(body.mesh, {});
    const CellIndex index(family);
    for (const double frame : {0.0, 2.0, 3.4, 7.0}) {
      const TriangleMesh surface = BlendAndSlice(index, {{}, frame / family.frames_per_second});
      const double expected = body.volume * std::pow(1.0 + 0.1 * frame, 3);
      EXPECT_NEAR(mesh::Volume(surface) / expected, 1.0, kTolerance) << "frame " << frame;
    }
  }
}

TEST(Slice, HasTwoTrianglesPerQuadWhereOnlyTimeEdgesCross) {
  const RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(5), {});
  const CellIndex index(family);
  const TriangleMesh surface = BlendAndSlice(index, {{}, 2.5 / family.frames_per_second});
  EXPECT_EQ(surface.num_triangles(), 2 * 6 * 5 * 5);
  EXPECT_EQ(surface.num_vertices(), 6 * 5 * 5 + 2);
}

TEST(Slice, FollowsAShiftInTime) {
  // At weight 1 everything happens two frames later.
  synthetic::ComplexOptions options;
  options.velocity_m_per_frame = {1.0F, 0.0F, 0.0F};
  const RegisteredFamily family = synthetic::MakeFamily(
      synthetic::HexahedralSphere(6, options),
      {{[](int64_t, const Eigen::Vector4f&) { return Eigen::Vector4f(0, 0, 0, 2); }, {}}});
  const CellIndex index(family);
  for (const double w : {0.0, 0.5, 1.0}) {
    const TriangleMesh surface = BlendAndSlice(index, {{w}, 4.0 / family.frames_per_second});
    EXPECT_NEAR(surface.vertices.row(0).mean(), 4.0 - 2.0 * w, 1e-4) << w;
  }
}

TEST(Slice, LooksOnlyAtCellsNearTheTime) {
  synthetic::ComplexOptions options;
  options.num_frames = 100;
  const RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(12, options),
                                                        {{synthetic::Noise(1, 0.1F, 0.5F), {}}});
  const CellIndex index(family);
  Workspace workspace;
  ASSERT_TRUE(FindCandidates(index, std::vector{1.0}, 2.0, workspace).ok());
  int64_t num_cells = 0;
  for (const int32_t c : workspace.clusters) num_cells += index.cluster(c).num_cells;
  EXPECT_GT(num_cells, 6 * 12 * 12);  // a frame's
  EXPECT_LT(num_cells, family.num_cells() / 10);
}

TEST(Slice, EndsEarlyWhenNobodyWaitsForItAnyMore) {
  const RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(12), {});
  const CellIndex index(family);
  std::atomic<bool> stop = false;
  Workspace workspace;
  workspace.stop = &stop;
  EXPECT_GT(synthetic::SliceFamily(index, {}, 0.1, workspace).num_triangles(), 1000);
  stop = true;
  EXPECT_EQ(synthetic::SliceFamily(index, {}, 0.1, workspace).num_triangles(), 0);
}

TEST(Slice, HasTheSameBytesInAnyNumberOfParts) {
  const RegisteredFamily family = SmoothFamily(synthetic::HexahedralSphere(36));
  const CellIndex index(family);
  Workspace alone;
  Workspace shared;  // used for slices in few and in many parts
  for (const int num_idle : {7, 1, 3}) {
    parallel::IdleThreads idle(num_idle);
    shared.helpers = &idle;
    for (const Query& query : RandomQueries(family, 20)) {
      const std::string expected =
          BytesOf(synthetic::SliceFamily(index, query.weights, query.time_s, alone));
      EXPECT_EQ(BytesOf(synthetic::SliceFamily(index, query.weights, query.time_s, shared)),
                expected);
      EXPECT_EQ(shared.near_vertex, alone.near_vertex);
      EXPECT_EQ(shared.far_vertex, alone.far_vertex);
    }
    EXPECT_EQ(idle.most_tasks, 2 * (num_idle + 1));
  }
}

// Nobody waits any more from the given part on; the parts are made one after another.
class StoppedFrom : public parallel::IdleThreads {
 public:
  explicit StoppedFrom(int part) : IdleThreads(3), part_(part) {}
  void Run(int num_tasks, absl::FunctionRef<void(int)> task) override {
    for (int k = num_tasks - 1; k >= 0; --k) {
      stop = k <= part_;
      task(k);
    }
  }
  std::atomic<bool> stop = false;

 private:
  const int part_;
};

TEST(Slice, ThatIsStoppedBetweenItsPartsNamesOnlyItsOwnVertices) {
  const RegisteredFamily family = SmoothFamily(synthetic::HexahedralSphere(36));
  const CellIndex index(family);
  StoppedFrom stopped(2);
  Workspace workspace;
  workspace.helpers = &stopped;
  workspace.stop = &stopped.stop;
  for (const Query& query : RandomQueries(family, 10)) {
    const TriangleMesh surface =
        synthetic::SliceFamily(index, query.weights, query.time_s, workspace);
    EXPECT_GT(surface.num_triangles(), 1000);
    EXPECT_TRUE(mesh::Validate(surface).ok());
    EXPECT_EQ(workspace.near_vertex.size(), static_cast<size_t>(surface.num_vertices()));
  }
}

TEST(Slice, RefusesTimesOutsideOfTheAnimation) {
  const RegisteredFamily family = synthetic::MakeFamily(synthetic::HexahedralSphere(2), {});
  const CellIndex index(family);
  Workspace workspace;
  for (const double time_s :
       {-1e-9, family.duration_s() + 1e-9, 1e300, std::numeric_limits<double>::quiet_NaN(),
        std::numeric_limits<double>::infinity()}) {
    const absl::Status status = FindCandidates(index, {}, time_s, workspace);
    EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange) << time_s;
    EXPECT_THAT(std::string(status.message()), testing::HasSubstr("[0, 0.29"));
  }
}

TEST(Slice, OfAFamilyWithoutCellsIsEmpty) {
  SpaceTimeMesh mesh;
  mesh.num_frames = 3;
  const RegisteredFamily family = mesh::ViewOf(mesh);
  const CellIndex index(family);
  const TriangleMesh surface = BlendAndSlice(index, {{}, 1.0 / 24.0});
  EXPECT_EQ(surface.num_vertices(), 0);
  EXPECT_EQ(surface.num_triangles(), 0);
}

}  // namespace
}  // namespace liquidblend::slice
