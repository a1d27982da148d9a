#include "worker/jobs/assemble_family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/synthetic/families.h"

namespace liquidblend::jobs {
namespace {

FamilyContents TwoTargets() {
  FamilyContents contents;
  contents.name = "family";
  contents.source_name = "still";
  contents.parameter_space = {{"speed"}, {{0}, {1}, {2}}, mesh::Interpolation::kSmooth};
  contents.source = synthetic::WedgeSphere(1);
  contents.bounds = Eigen::AlignedBox3f(Eigen::Vector3f(-1, -1, -1), Eigen::Vector3f(1, 2, 3));
  contents.targets.resize(2);
  for (RegisteredTarget& target : contents.targets) {
    target.registration.displacement.setConstant(4, contents.source.num_vertices(), 0.25F);
  }
  contents.source_report.num_vertices = 1;
  contents.targets[0].space_time.num_vertices = 2;
  contents.targets[1].space_time.num_vertices = 3;
  contents.targets[0].name = "slow";
  contents.targets[1].name = "fast";
  contents.targets[1].registration.report.num_nodes = 7;
  contents.targets[1].registration.extrapolation.setConstant(4, contents.source.num_vertices(),
                                                             0.5F);
  return contents;
}

TEST(AssembleFamily, OwnsAllThatItShows) {
  const FamilyContents contents = TwoTargets();
  const auto family = AssembleFamily(contents);
  ASSERT_TRUE(family.ok()) << family.status();
  EXPECT_TRUE(mesh::Validate(*family).ok());
  EXPECT_EQ(family->name, "family");
  EXPECT_EQ(family->source, "still");
  EXPECT_EQ(family->parameter_space.points, contents.parameter_space.points);
  EXPECT_EQ(family->parameter_space.interpolation, mesh::Interpolation::kSmooth);
  ASSERT_EQ(family->targets.size(), 2U);
  EXPECT_EQ(family->targets[1].name, "fast");
  EXPECT_EQ(family->targets[1].report.num_nodes, 7);
  ASSERT_EQ(family->space_time_reports.size(), 3U);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(family->space_time_reports[k].num_vertices, k + 1);
  EXPECT_EQ(family->targets[0].displacement.back(), (mesh::Float4{0.25F, 0.25F, 0.25F, 0.25F}));
  EXPECT_TRUE(family->targets[0].extrapolation.empty());
  EXPECT_EQ(family->targets[1].extrapolation.front(), (mesh::Float4{0.5F, 0.5F, 0.5F, 0.5F}));
  for (int64_t v = 0; v < contents.source.num_vertices(); ++v) {
    for (int i = 0; i < 4; ++i) ASSERT_EQ(family->vertices[v][i], contents.source.vertices(i, v));
  }
}

TEST(AssembleFamily, LevelsAreFamiliesOfTheirOwn) {
  FamilyContents contents = TwoTargets();
  FamilyLevel level;
  level.mesh = synthetic::WedgeSphere(0);
  level.targets.resize(2);
  for (registration::Registration& target : level.targets) {
    target.displacement.setConstant(4, level.mesh.num_vertices(), 0.75F);
  }
  const int64_t num_vertices = level.mesh.num_vertices();
  contents.coarser_levels.push_back(std::move(level));
  const double edge_length_m = contents.source.edge_length_m;
  const auto family = AssembleFamily(std::move(contents));
  ASSERT_TRUE(family.ok()) << family.status();
  ASSERT_EQ(family->coarser_levels.size(), 1U);
  const mesh::RegisteredFamily& coarse = family->coarser_levels[0];
  EXPECT_EQ(static_cast<int64_t>(coarse.vertices.size()), num_vertices);
  EXPECT_EQ(coarse.targets[1].name, "fast");
  EXPECT_EQ(coarse.targets[1].displacement.back(), (mesh::Float4{0.75F, 0.75F, 0.75F, 0.75F}));
  EXPECT_EQ(coarse.edge_length_m, edge_length_m);
  EXPECT_EQ(coarse.domain_max, family->domain_max);
}

TEST(AssembleFamily, TheDomainIsOneEdgeLargerThanTheBounds) {
  const FamilyContents contents = TwoTargets();
  const float edge_m = static_cast<float>(contents.source.edge_length_m);
  const auto family = AssembleFamily(contents);
  ASSERT_TRUE(family.ok()) << family.status();
  EXPECT_FLOAT_EQ(family->domain_min[2], -1 - edge_m);
  EXPECT_FLOAT_EQ(family->domain_max[1], 2 + edge_m);
}

TEST(AssembleFamily, ARegistrationThatIsNotFiniteIsRefused) {
  FamilyContents contents = TwoTargets();
  contents.targets[0].registration.displacement(2, 7) = std::numeric_limits<float>::quiet_NaN();
  const auto family = AssembleFamily(std::move(contents));
  EXPECT_EQ(family.status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(family.status().message()), testing::HasSubstr("family"));
}

}  // namespace
}  // namespace liquidblend::jobs
