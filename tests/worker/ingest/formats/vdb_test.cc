// OpenVDB files, written by the library itself, as our reader takes and refuses them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/worker/ingest/formats/encode_vdb.h"
#include "worker/ingest/clean/clean.h"
#include "worker/ingest/formats/readers.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::ingest::vdb_test {
namespace {

using openvdb::Vec3d;
using testing::HasSubstr;

constexpr double kVoxel = 0.05;
constexpr double kRadius = 0.6;
const Vec3d kCenter(0.21, -0.13, 0.07);

std::string Error(const Bytes& bytes) {
  const absl::StatusOr<VdbFrame> frame = ReadVdb(bytes);
  return frame.ok() ? "no error" : std::string(frame.status().message());
}

// The mesh of a file that is read, cleaned as ReadAnimation does.
mesh::TriangleMesh ReadClean(const Bytes& bytes) {
  absl::StatusOr<VdbFrame> frame = ReadVdb(bytes);
  EXPECT_TRUE(frame.ok()) << frame.status();
  if (!frame.ok()) return {};
  const absl::StatusOr<CleanCounts> counts = Clean(frame->mesh);
  EXPECT_TRUE(counts.ok()) << counts.status();
  return frame->mesh;
}

void ExpectBall(const mesh::TriangleMesh& mesh, const Vec3d& center, double tolerance) {
  ASSERT_GT(mesh.num_triangles(), 500);
  const double volume = 4.0 / 3.0 * M_PI * kRadius * kRadius * kRadius;
  EXPECT_NEAR(mesh::Volume(mesh), volume, 0.02 * volume);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Vec3d p(mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v));
    EXPECT_NEAR((p - center).length(), kRadius, tolerance);
  }
}

TEST(ReadVdb, MeshesTheLevelSetOfABallInWorldUnits) {
  const mesh::TriangleMesh mesh = ReadClean(Vdb(BallLevelSet(kCenter, kRadius)));
  ExpectBall(mesh, kCenter, 0.1 * kVoxel);
  EXPECT_EQ(mesh::NumComponents(mesh), 1);
  EXPECT_EQ(mesh.velocities.cols(), 0);
}

TEST(ReadVdb, ReadsEachCompressionAlike) {
  using namespace openvdb::io;
  const auto grid = BallLevelSet(kCenter, kRadius);
  const absl::StatusOr<VdbFrame> plain = ReadVdb(Vdb({grid}, COMPRESS_NONE));
  ASSERT_TRUE(plain.ok()) << plain.status();
  ExpectBall(plain->mesh, kCenter, 0.1 * kVoxel);
  for (const int compression :
       {int{COMPRESS_ZIP}, int{COMPRESS_ACTIVE_MASK}, int{COMPRESS_BLOSC},
        COMPRESS_ZIP | COMPRESS_ACTIVE_MASK, COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK}) {
    const absl::StatusOr<VdbFrame> read = ReadVdb(Vdb({grid}, compression));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(read->mesh.vertices, plain->mesh.vertices) << compression;
    EXPECT_EQ(read->mesh.triangles, plain->mesh.triangles) << compression;
  }
}

TEST(ReadVdb, ReadsHalfFloats) {
  using namespace openvdb::io;
  const auto grid = BallLevelSet(kCenter, kRadius, {.is_half = true});
  for (const int compression : {int{COMPRESS_NONE}, COMPRESS_ZIP | COMPRESS_ACTIVE_MASK}) {
    ExpectBall(ReadClean(Vdb({grid}, compression)), kCenter, 0.1 * kVoxel);
  }
}

TEST(ReadVdb, AppliesEachKindOfTransform) {
  const auto grid = BallLevelSet({0, 0, 0}, kRadius);
  const auto with = [&](const openvdb::math::Transform::Ptr& transform) {
    grid->setTransform(transform);
    return ReadClean(Vdb(grid));
  };
  using openvdb::math::Transform;
  const Vec3d moved(3, -2, 1);
  ExpectBall(with(Transform::createLinearTransform(kVoxel)), {0, 0, 0}, 0.1 * kVoxel);
  auto transform = Transform::createLinearTransform(kVoxel);
  transform->postTranslate(moved);
  ExpectBall(with(transform), moved, 0.1 * kVoxel);
  transform->preRotate(0.7, openvdb::math::Y_AXIS);
  ExpectBall(with(transform), moved, 0.1 * kVoxel);
  // A mirror image faces outward, too.
  openvdb::math::Mat4d mirror = openvdb::math::Mat4d::identity();
  for (int axis = 0; axis < 3; ++axis) mirror[axis][axis] = axis == 1 ? -kVoxel : kVoxel;
  mirror.setTranslation(moved);
  ExpectBall(with(Transform::createLinearTransform(mirror)), moved, 0.1 * kVoxel);
  transform = Transform::createLinearTransform(1.0);
  transform->postScale(Vec3d(kVoxel, kVoxel, 2 * kVoxel));
  EXPECT_NEAR(mesh::Volume(with(transform)), 2 * 4.0 / 3.0 * M_PI * std::pow(kRadius, 3), 0.04);
}

TEST(ReadVdb, SamplesVelocitiesAtTheVertices) {
  const auto field = [](const Vec3d& p) { return Vec3d(1 + p.x(), 2 * p.y() - p.z(), -p.x()); };
  const auto level_set = BallLevelSet(kCenter, kRadius);
  for (const bool is_half : {false, true}) {
    for (const openvdb::GridClass grid_class : {openvdb::GRID_UNKNOWN, openvdb::GRID_STAGGERED}) {
      const auto velocities = Velocities(field, 14,
                                         {.name = "vel",
                                          .voxel_size = 0.1,
                                          .translation = {0.03, 0.02, 0.01},
                                          .grid_class = grid_class,
                                          .is_half = is_half});
      const absl::StatusOr<VdbFrame> read =
          ReadVdb(Vdb({velocities, level_set}, openvdb::io::COMPRESS_ACTIVE_MASK));
      ASSERT_TRUE(read.ok()) << read.status();
      EXPECT_EQ(read->velocities, "vel");
      ASSERT_EQ(read->mesh.velocities.cols(), read->mesh.vertices.cols());
      for (Eigen::Index v = 0; v < read->mesh.vertices.cols(); ++v) {
        const Eigen::Vector3d p = read->mesh.vertices.col(v).cast<double>();
        const Vec3d expected = field({p.x(), p.y(), p.z()});
        for (int axis = 0; axis < 3; ++axis) {
          // A linear field is sampled exactly, up to rounding.
          EXPECT_NEAR(read->mesh.velocities(axis, v), expected[axis], is_half ? 4e-3 : 1e-5);
        }
      }
    }
  }
}

TEST(ReadVdb, TakesSurfaceThenDensityThenTheFirstLevelSet) {
  const auto ball = [](const std::string& name, openvdb::GridClass grid_class) {
    return BallLevelSet({0, 0, 0}, 0.2, {.name = name, .grid_class = grid_class});
  };
  const auto taken = [](const openvdb::GridCPtrVec& grids) {
    const absl::StatusOr<VdbFrame> read = ReadVdb(Vdb(grids, openvdb::io::COMPRESS_NONE));
    return read.ok() ? read->level_set : std::string(read.status().message());
  };
  const auto first = ball("phi", openvdb::GRID_LEVEL_SET);
  const auto density = ball("density", openvdb::GRID_LEVEL_SET);
  const auto surface = ball("surface", openvdb::GRID_UNKNOWN);
  const auto fog = ball("density", openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(taken({first, density, surface}), "surface");
  EXPECT_EQ(taken({first, density}), "density");
  EXPECT_EQ(taken({fog, first}), "phi");
  EXPECT_EQ(taken({first, first}), "phi");  // names are made unique in the file
  EXPECT_EQ(taken({ball("other", openvdb::GRID_UNKNOWN)}),
            "no grid of floats is a level set; its grids are \"other\" (\"unknown\", "
            "\"Tree_float_5_4_3\")");
}

TEST(ReadVdb, RefusesFogVolumes) {
  EXPECT_THAT(Error(Vdb(BallLevelSet({0, 0, 0}, 0.2,
                                     {.name = "density", .grid_class = openvdb::GRID_FOG_VOLUME}))),
              HasSubstr("grid \"density\" is a fog volume, which has no surface"));
  auto fog = openvdb::FloatGrid::create(0.0f);
  fog->setName("density");
  fog->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(5)), 0.7f);
  EXPECT_THAT(Error(Vdb(fog)), HasSubstr("grid \"density\": its background is 0"));
}

TEST(ReadVdb, AllowsALevelSetWithoutLiquid) {
  auto empty = openvdb::FloatGrid::create(0.15f);
  empty->setGridClass(openvdb::GRID_LEVEL_SET);
  const absl::StatusOr<VdbFrame> read = ReadVdb(Vdb(empty));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->mesh.num_vertices(), 0);
  EXPECT_EQ(read->mesh.num_triangles(), 0);
  openvdb::math::Mat4d mirror = openvdb::math::Mat4d::identity();
  mirror[0][0] = -1;
  empty->setTransform(openvdb::math::Transform::createLinearTransform(mirror));
  EXPECT_TRUE(ReadVdb(Vdb(empty)).ok());
}

TEST(ReadVdb, SaysInANoteWhatWasTaken) {
  const Bytes file = Vdb(BallLevelSet({0, 0, 0}, 0.2, {.name = "phi"}));
  const std::vector<InputFile> files = {{"a_1.vdb", file}, {"a_2.vdb", file}};
  const absl::StatusOr<mesh::Animation> read =
      ReadAnimation("balls", files, {}, parallel::Arena(2));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_FALSE(read->notes.empty());
  EXPECT_EQ(read->notes[0],
            "Took grid \"phi\" as the level set and none as its velocities, in 2 of 2 frames.");
}

TEST(ReadVdb, GivesTheSameBytesForAnyThreadCount) {
  const Bytes file = Vdb(BallLevelSet(kCenter, kRadius));
  const std::vector<InputFile> files = {{"a_1.vdb", file}, {"a_2.vdb", file}, {"a_3.vdb", file}};
  const absl::StatusOr<mesh::Animation> one = ReadAnimation("b", files, {}, parallel::Arena(1));
  ASSERT_TRUE(one.ok()) << one.status();
  for (const int num_threads : {2, 8}) {
    const auto more = ReadAnimation("b", files, {}, parallel::Arena(num_threads));
    ASSERT_TRUE(more.ok()) << more.status();
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(more->frames[k].vertices, one->frames[k].vertices);
      EXPECT_EQ(more->frames[k].triangles, one->frames[k].triangles);
    }
  }
}

TEST(ReadVdb, RefusesFilesThatItCannotRead) {
  Bytes bytes = Vdb(BallLevelSet({0, 0, 0}, 0.2));
  EXPECT_THAT(Error(ToBytes("BDV")), HasSubstr("does not begin like an OpenVDB file"));
  constexpr size_t kVersionAt = 8;
  bytes[kVersionAt] = std::byte{213};
  EXPECT_THAT(Error(bytes), HasSubstr("OpenVDB file format 213, but 222 to 224 are read"));
  bytes[kVersionAt] = std::byte{224};
  bytes.resize(bytes.size() - 100);
  EXPECT_THAT(Error(bytes), HasSubstr("the file is truncated: grid \"surface\" ends at byte"));
  auto grid = BallLevelSet({0, 0, 0}, 0.2);
  grid->tree().setValue(openvdb::Coord(1, 2, 3), std::numeric_limits<float>::quiet_NaN());
  EXPECT_THAT(Error(Vdb(grid)), HasSubstr("a value is nan, in the node at voxel (0, 0, 0)"));
  grid = BallLevelSet({0, 0, 0}, 0.2);
  grid->tree().setValue(openvdb::Coord(1 << 24, 0, 0), 1.0f);
  EXPECT_THAT(Error(Vdb(grid)), HasSubstr("a node begins at voxel 16777216"));
  grid = BallLevelSet({0, 0, 0}, 0.2);
  grid->setName("surface");
  auto frustum = openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(Vec3d(0), Vec3d(20)), 0.5, 10.0, 1.0);
  grid->setTransform(frustum);
  EXPECT_THAT(Error(Vdb(grid)), HasSubstr("no grid of floats is a level set"));
}

// Liquid against a wall of the domain: behind the last voxel there is nothing but background.
TEST(ReadVdb, ClosesLiquidThatTheGridCutsOff) {
  const auto grid = BallLevelSet({0, 0, 0}, kRadius);
  std::vector<openvdb::Coord> beyond;
  for (auto voxel = grid->cbeginValueOn(); voxel; ++voxel) {
    if (voxel.getCoord().z() < -3) beyond.push_back(voxel.getCoord());
  }
  for (const openvdb::Coord& voxel : beyond) grid->tree().setValueOff(voxel, grid->background());
  // What was inside below is outside now.
  grid->tree().prune();
  auto clipped = openvdb::FloatGrid::create(grid->background());
  auto accessor = clipped->getAccessor();
  for (int x = -16; x < 16; ++x) {
    for (int y = -16; y < 16; ++y) {
      for (int z = -3; z < 16; ++z) {
        const openvdb::Coord voxel(x, y, z);
        accessor.setValue(voxel, grid->tree().getValue(voxel));
      }
    }
  }
  clipped->setName("surface");
  clipped->setTransform(openvdb::math::Transform::createLinearTransform(kVoxel));
  const mesh::TriangleMesh mesh = ReadClean(Vdb(clipped));
  EXPECT_TRUE(mesh::CheckClosed(mesh).closed());
  EXPECT_NEAR(mesh.vertices.row(2).minCoeff(), -3.5 * kVoxel, kVoxel);
}

// Values without any order: ambiguous cells of all kinds.
TEST(ReadVdb, MeshesNoiseIntoAClosedManifold) {
  std::mt19937 random(5);
  for (int round = 0; round < 40; ++round) {
    std::uniform_real_distribution<float> noise(-1.0f, 3.0f);
    auto grid = openvdb::FloatGrid::create(1.0f);
    grid->setName("surface");
    for (int i = 0; i < 8 * 8 * 8; ++i) {
      const float value = noise(random);
      grid->tree().setValue(openvdb::Coord(i / 64 + 4, i / 8 % 8 + 4, i % 8 + 4), value);
    }
    absl::StatusOr<VdbFrame> read = ReadVdb(Vdb(grid));
    ASSERT_TRUE(read.ok()) << read.status();
    const absl::StatusOr<CleanCounts> counts = Clean(read->mesh);
    EXPECT_TRUE(counts.ok()) << counts.status();
    EXPECT_TRUE(mesh::CheckClosed(read->mesh).closed());
  }
}

}  // namespace
}  // namespace liquidblend::ingest::vdb_test
