// What browsers decode, by npm's draco3d (WebAssembly): the same as libdraco.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/parallel/arena.h"
#include "core/slice/slice.h"
#include "server/encode/draco.h"
#include "tests/paths.h"
#include "tests/server/encode/encode_testing.h"
#include "tests/server/encode/scrambled_surface.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/slice_family.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"
#include "worker/spacetime/build.h"

namespace liquidblend::encode {
namespace {

using mesh::TriangleMesh;

// Position, normal and velocity of three corners, to the bit; zeros where there are none.
using Triangle = std::array<uint32_t, 27>;

std::vector<Triangle> TriangleSet(const TriangleMesh& mesh) {
  std::vector<Triangle> triangles;
  for (Eigen::Index t = 0; t < mesh.num_triangles(); ++t) {
    Triangle corners = {};
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.triangles(k, t);
      std::memcpy(&corners[9 * k], mesh.vertices.col(v).data(), 12);
      if (mesh.normals.cols() > 0) std::memcpy(&corners[9 * k + 3], mesh.normals.col(v).data(), 12);
      if (mesh.velocities.cols() > 0) {
        std::memcpy(&corners[9 * k + 6], mesh.velocities.col(v).data(), 12);
      }
    }
    Triangle& lowest = triangles.emplace_back(corners);
    for (int turn = 0; turn < 2; ++turn) {
      std::rotate(corners.begin(), corners.begin() + 9, corners.end());
      lowest = std::min(lowest, corners);
    }
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

std::string ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// What decode.mjs has written.
TriangleMesh ReadDecoded(const std::string& path) {
  const std::string bytes = ReadBytes(path);
  std::array<uint32_t, 4> counts = {};  // points, triangles, are there normals, velocities
  TriangleMesh mesh;
  size_t at = 0;
  const auto take = [&](void* to, size_t size) {
    ASSERT_LE(at + size, bytes.size()) << path;
    if (size > 0) std::memcpy(to, bytes.data() + at, size);  // `to` is null of no numbers
    at += size;
  };
  take(counts.data(), sizeof(counts));
  mesh.triangles.resize(3, counts[1]);
  take(mesh.triangles.data(), 12 * size_t{counts[1]});
  mesh.vertices.resize(3, counts[0]);
  mesh.normals.resize(3, counts[2] * counts[0]);
  mesh.velocities.resize(3, counts[3] * counts[0]);
  for (Eigen::Matrix3Xf* values : {&mesh.vertices, &mesh.normals, &mesh.velocities}) {
    take(values->data(), 12 * static_cast<size_t>(values->cols()));
  }
  EXPECT_EQ(at, bytes.size()) << path;
  return mesh;
}

class WasmDecoderTest : public testing::Test {
 protected:
  void SetUp() override {
    directory_ = testing::TempDir() + "/wasm_" +
                 testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
  }

  // At every preset.
  void Add(const std::string& name, const TriangleMesh& surface, DracoOptions options) {
    for (const Preset preset : {Preset::kFastest, Preset::kBalanced, Preset::kSmallest}) {
      options.preset = preset;
      const auto data = EncodeDraco(surface, options);
      ASSERT_TRUE(data.ok()) << data.status();
      const std::string path = absl::StrCat(directory_, "/", name, "_", preset, ".drc");
      std::ofstream(path, std::ios::binary) << *data;
      paths_.push_back(path);
    }
  }

  // Compares all that was added.
  void Judge() {
    const std::string script = std::string(LIQUIDBLEND_WASM_DIR) + "/decode.mjs";
    const std::string remarks = directory_ + "/remarks";
    ASSERT_TRUE(
        std::filesystem::exists(std::string(LIQUIDBLEND_WASM_DIR) + "/node_modules/draco3d"))
        << "npm's draco3d is not there: deploy/install-deps.sh fetches it";
    const std::string command =
        absl::StrCat("node '", script, "' '", directory_, "' >'", remarks, "' 2>&1");
    ASSERT_EQ(std::system(command.c_str()), 0)
        << "node (deploy/install-deps.sh installs it) says: " << ReadBytes(remarks);
    for (const std::string& path : paths_) {
      const TriangleMesh expected = Decode(ReadBytes(path));
      const TriangleMesh decoded = ReadDecoded(path.substr(0, path.size() - 3) + "bin");
      EXPECT_EQ(decoded.normals.cols() > 0, expected.normals.cols() > 0) << path;
      EXPECT_EQ(decoded.velocities.cols() > 0, expected.velocities.cols() > 0) << path;
      EXPECT_TRUE(TriangleSet(decoded) == TriangleSet(expected)) << path;
    }
  }

  std::string directory_;
  std::vector<std::string> paths_;
};

TEST_F(WasmDecoderTest, DecodesSlicesOfARealSimulation) {
  const parallel::Arena arena;
  const auto files = ingest::LoadDirectory(paths::Source("tests/data/two_drops/A"));
  ASSERT_TRUE(files.ok()) << files.status();
  const auto animation = ingest::ReadAnimation("A", ingest::Views(*files), {}, arena);
  ASSERT_TRUE(animation.ok()) << animation.status();
  const auto built = spacetime::Build(*animation, {}, arena);
  ASSERT_TRUE(built.ok()) << built.status();
  const mesh::RegisteredFamily family = mesh::ViewOf(*built);
  const slice::CellIndex index(family);
  slice::Workspace workspace;
  DracoOptions options;
  options.grid = frames::GridOf(family);
  int64_t most_components = 0;
  for (const double frame : {0.5, 20.25, 40.0, 66.75}) {
    TriangleMesh surface =
        synthetic::SliceFamily(index, {}, frame / family.frames_per_second, workspace);
    most_components = std::max(most_components, mesh::NumComponents(surface));
    Add(absl::StrCat("slice_", frame), surface, options);
  }
  EXPECT_GT(most_components, 2) << "drops and droplets";
  Judge();
}

TEST_F(WasmDecoderTest, DecodesNormalsAndVelocities) {
  TriangleMesh sphere = synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 4);
  sphere.normals = sphere.vertices;
  Add("normals", sphere, OptionsWith(14));
  sphere.velocities = (3.0F * sphere.vertices).colwise() + Eigen::Vector3f(1, 2, 3);
  Add("both", sphere, OptionsWith(14));
  sphere.normals.resize(3, 0);
  Add("velocities", sphere, OptionsWith(11));
  Judge();
}

TEST_F(WasmDecoderTest, DecodesOddSurfaces) {
  ScrambledSurface surface(synthetic::Icosphere(Eigen::Vector3f::Zero(), 1.0, 3));
  for (uint64_t k = 0; k < 200; ++k) surface.TurnEdge(37 * k, k);
  Add("turned", surface.mesh(), OptionsWith(12));
  for (uint64_t k = 0; k < 20; ++k) surface.MergeVertices(31 * k, 17 * k + 5);
  Add("touching", surface.mesh(), OptionsWith(20));
  surface.DropTriangle(7);
  Add("open", surface.mesh(), OptionsWith(8));
  Add("nothing", TriangleMesh(), OptionsWith(14));
  Judge();
}

}  // namespace
}  // namespace liquidblend::encode
