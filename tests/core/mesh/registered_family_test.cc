#include "core/mesh/registered_family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace liquidblend::mesh::registered_family_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A family with one cell of each kind and one target, and what it views.
struct Sample {
  std::vector<Float4> vertices;
  std::vector<Tetrahedron> tetrahedra = {{0, 1, 2, 3}};
  std::vector<Pyramid> pyramids = {{1, 2, 3, 4, 5}};
  std::vector<Wedge> wedges = {{2, 3, 4, 5, 6, 7}};
  std::vector<Hexahedron> hexahedra = {{2, 3, 4, 5, 6, 7, 8, 9}};
  std::vector<Float4> displacement = std::vector<Float4>(10, Float4{0.1f, 0.2f, 0.3f, 1.0f});
  std::vector<Float4> extrapolation = std::vector<Float4>(10, Float4{0.1f, 0.1f, 0.1f, 0.5f});

  Sample() {
    for (int v = 0; v < 10; ++v) vertices.push_back({0.1f * float(v), 0.0f, 0.0f, float(v) - 0.5f});
  }

  RegisteredFamily View() const {
    RegisteredFamily family;
    family.name = "walls";
    family.source = "thin";
    family.vertices = vertices;
    family.tetrahedra = tetrahedra;
    family.pyramids = pyramids;
    family.wedges = wedges;
    family.hexahedra = hexahedra;
    family.targets = {{"thick", displacement, extrapolation, {}}};
    family.num_first_vertices = 1;
    family.num_last_vertices = 1;
    family.num_frames = 9;
    family.edge_length_m = 0.1;
    family.domain_max = {1, 1, 1};
    return family;
  }
};

void ExpectFault(const RegisteredFamily& family, const std::string& words) {
  const absl::Status status = Validate(family);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("family walls: " + words));
}

TEST(ValidateRegisteredFamily, AcceptsAFamilyWithAllKindsOfCells) {
  const Sample sample;
  EXPECT_TRUE(Validate(sample.View()).ok()) << Validate(sample.View());
  RegisteredFamily family = sample.View();
  family.targets[0].extrapolation = {};
  EXPECT_TRUE(Validate(family).ok());
}

TEST(ValidateRegisteredFamily, NamesCornersOutOfRange) {
  Sample sample;
  sample.tetrahedra.push_back({0, 1, 2, 10});
  ExpectFault(sample.View(), "tetrahedron 1 has vertex 10, of 10");
  sample = Sample();
  sample.pyramids[0][4] = -1;
  ExpectFault(sample.View(), "pyramid 0 has vertex -1, of 10");
  sample = Sample();
  sample.wedges[0][5] = std::numeric_limits<int32_t>::max();
  ExpectFault(sample.View(), "wedge 0 has vertex 2147483647, of 10");
  sample = Sample();
  sample.hexahedra[0][0] = std::numeric_limits<int32_t>::min();
  ExpectFault(sample.View(), "hexahedron 0 has vertex -2147483648, of 10");
}

TEST(ValidateRegisteredFamily, NamesNumbersThatAreNotFinite) {
  Sample sample;
  sample.vertices[3][2] = kNan;
  ExpectFault(sample.View(), "vertex 3 is not finite");
  sample = Sample();
  sample.displacement[9][3] = std::numeric_limits<float>::infinity();
  ExpectFault(sample.View(), "target thick: displacement 9 is not finite");
  sample = Sample();
  sample.extrapolation[0][0] = kNan;
  ExpectFault(sample.View(), "target thick: extrapolation 0 is not finite");
}

TEST(ValidateRegisteredFamily, NamesVelocitiesThatDoNotFit) {
  const Sample sample;
  std::vector<Float3> velocities(10, Float3{1, 2, 3});
  RegisteredFamily family = sample.View();
  family.velocities = velocities;
  EXPECT_TRUE(Validate(family).ok()) << Validate(family);
  velocities[7][1] = kNan;
  ExpectFault(family, "velocity 7 is not finite");
  family.velocities = family.velocities.first(9);
  ExpectFault(family, "9 velocities for 10 vertices");
}

TEST(ValidateRegisteredFamily, NamesLevelsThatDoNotFit) {
  const Sample sample;
  RegisteredFamily family = sample.View();
  family.coarser_levels = {sample.View(), sample.View()};
  EXPECT_TRUE(Validate(family).ok()) << Validate(family);
  const auto expect_fault = [&](const std::function<void(RegisteredFamily&)>& change,
                                const std::string& words) {
    RegisteredFamily changed = family;
    change(changed.coarser_levels[1]);
    ExpectFault(changed, "level of detail 2" + words);
  };
  expect_fault([](auto& level) { level.targets.clear(); }, " has other targets");
  expect_fault([](auto& level) { level.num_frames = 8; }, " has other targets, frames");
  expect_fault([](auto& level) { level.domain_max[0] = 2; }, " has other targets, frames, domain");
  expect_fault([](auto& level) { level.rest_time_s = -1; },
               " has other targets, frames, domain, rest time");
  expect_fault([&](auto& level) { level.coarser_levels = {sample.View()}; },
               " has other targets, frames, domain, rest time, or levels of its own");
  expect_fault([](auto& level) { level.vertices = level.vertices.first(9); },
               ": family walls: vertex 8 of the last slab");
}

TEST(ValidateRegisteredFamily, NamesTargetsOfTheWrongSize) {
  Sample sample;
  sample.displacement.pop_back();
  ExpectFault(sample.View(), "target thick displaces 9 of 10 vertices");
  sample = Sample();
  sample.extrapolation.pop_back();
  ExpectFault(sample.View(), "target thick extrapolates 9 of 10 vertices");
  sample = Sample();
  sample.displacement.clear();
  ExpectFault(sample.View(), "target thick displaces 0 of 10 vertices");
}

TEST(ValidateRegisteredFamily, NamesEndSlabsThatReachIntoTheAnimation) {
  const Sample sample;
  RegisteredFamily family = sample.View();
  family.num_first_vertices = 2;
  ExpectFault(family, "vertex 1 of the first slab has time 0.5, not before frame 0");
  family = sample.View();
  family.num_last_vertices = 2;
  ExpectFault(family, "vertex 8 of the last slab has time 7.5, not after frame 8");
  family = sample.View();
  family.num_last_vertices = 10;
  ExpectFault(family, "1 vertices in the first and 10 in the last slab, of 10");
  family = sample.View();
  family.num_first_vertices = std::numeric_limits<int64_t>::max();
  family.num_last_vertices = std::numeric_limits<int64_t>::max();
  ExpectFault(family, "9223372036854775807 vertices in the first");
}

TEST(ValidateRegisteredFamily, NamesUnusableNumbers) {
  const Sample sample;
  RegisteredFamily family = sample.View();
  family.num_frames = 0;
  ExpectFault(family, "num_frames = 0");
  family = sample.View();
  family.frames_per_second = -24.0;
  ExpectFault(family, "frames_per_second = -24");
  family.frames_per_second = 1e200;
  EXPECT_TRUE(Validate(family).ok());
  family.rest_time_s = -3600;
  ExpectFault(family, "a rest time with frames_per_second = 1e+200");
  family.frames_per_second = 24;
  family.rest_time_s = 0.5;
  ExpectFault(family, "rest_time_s = 0.5");
  family = sample.View();
  family.edge_length_m = std::numeric_limits<double>::infinity();
  ExpectFault(family, "edge_length_m = inf");
  family = sample.View();
  family.domain_min[1] = 2.0f;
  ExpectFault(family, "domain from 2 to 1 along axis 1");
  family = sample.View();
  family.domain_max[2] = kNan;
  ExpectFault(family, "domain from 0 to nan along axis 2");
}

TEST(ValidateRegisteredFamily, NamesLivesOfPartsThatCannotBe) {
  const Sample sample;
  RegisteredFamily family = sample.View();
  family.targets[0].report.part_lives = {{{1, 2, 3}, 0, 7.5}};
  EXPECT_TRUE(Validate(family).ok());
  family.targets[0].report.part_lives[0].target_end_frames = -1;
  ExpectFault(family, "target thick: a part ends at frame -1");
  family.targets[0].report.part_lives[0] = {{1, 2, 3}, kNan, 1};
  ExpectFault(family, "target thick: a part ends at frame nan");
  family.targets[0].report.part_lives[0] = {{1, static_cast<float>(kNan), 3}, 1, 1};
  ExpectFault(family, "target thick: start of part 0 is not finite");
}

TEST(ViewOf, ShowsTheMeshAsItIs) {
  SpaceTimeMesh mesh;
  mesh.vertices.resize(4, 4);
  mesh.vertices << 0, 1, 0, 0,  //
      0, 0, 2, 0,               //
      -1, 0, 0, 3,              //
      0, 1, 2, 3;
  mesh.tetrahedra = {{0, 1, 2, 3}};
  mesh.num_last_vertices = 1;
  mesh.num_frames = 3;
  mesh.frames_per_second = 10.0;
  mesh.edge_length_m = 0.5;
  const RegisteredFamily family = ViewOf(mesh);
  EXPECT_TRUE(Validate(family).ok()) << Validate(family);
  EXPECT_EQ(static_cast<const void*>(family.vertices.data()), mesh.vertices.data());
  EXPECT_THAT(family.vertices[2], ElementsAre(0, 2, 0, 2));
  EXPECT_EQ(family.num_cells(), 1);
  EXPECT_EQ(family.num_last_vertices, 1);
  EXPECT_EQ(family.edge_length_m, 0.5);
  EXPECT_TRUE(family.targets.empty());
  EXPECT_DOUBLE_EQ(family.duration_s(), 0.2);
  EXPECT_THAT(family.domain_min, ElementsAre(0, 0, -1));
  EXPECT_THAT(family.domain_max, ElementsAre(1, 2, 3));
}

}  // namespace
}  // namespace liquidblend::mesh::registered_family_test
