#include "worker/jobs/job_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace liquidblend::jobs {
namespace {

TEST(JobOptions, ZeroStandsForTheStagesDefault) {
  const registration::RegistrationOptions defaults;
  const registration::RegistrationOptions options = ToRegistrationOptions({});
  EXPECT_EQ(options.max_iterations, defaults.max_iterations);
  EXPECT_EQ(options.node_spacing_edges, defaults.node_spacing_edges);
  EXPECT_EQ(options.sample_share, defaults.sample_share);
  EXPECT_EQ(options.seed, defaults.seed);
  EXPECT_EQ(options.final_smoothness, defaults.final_smoothness);
  EXPECT_EQ(options.thin_sheets_from, defaults.thin_sheets_from);
  EXPECT_EQ(options.automatic_correspondences, defaults.automatic_correspondences);
  const spacetime::BuildOptions built, build_defaults = ToBuildOptions({});
  EXPECT_EQ(built.connectivity, build_defaults.connectivity);
  EXPECT_EQ(built.spacing_edges, build_defaults.spacing_edges);
  EXPECT_EQ(built.droplet_vertices, build_defaults.droplet_vertices);
  EXPECT_EQ(built.sheet_thickness_edges, build_defaults.sheet_thickness_edges);
  EXPECT_EQ(NumCoarserLevels({}), 2);
}

TEST(JobOptions, WhatIsGivenReachesTheStage) {
  store::v1::RegistrationOptions record;
  record.set_max_iterations(5);
  record.set_node_spacing_edges(7.5);
  record.set_sample_share(0.25);
  record.set_seed(99);
  record.set_final_smoothness(0.5);
  record.set_thin_sheets_from(0.75);
  record.set_automatic_correspondences(false);
  const registration::RegistrationOptions options = ToRegistrationOptions(record);
  EXPECT_EQ(options.max_iterations, 5);
  EXPECT_EQ(options.refine_iterations, 5);
  EXPECT_EQ(options.node_spacing_edges, 7.5);
  EXPECT_EQ(options.sample_share, 0.25);
  EXPECT_EQ(options.seed, 99U);
  EXPECT_EQ(options.final_smoothness, 0.5);
  EXPECT_EQ(options.thin_sheets_from, 0.75);
  EXPECT_FALSE(options.automatic_correspondences);

  store::v1::ImportOptions import;
  import.set_format(store::v1::ImportOptions::MANTAFLOW);
  import.set_frames_per_second(30);
  import.set_vertex_scale(2);
  import.set_velocity_scale(3);
  import.set_voxel_size_m(4);
  import.set_allow_gaps(true);
  import.set_up(store::v1::UP_MINUS_Z);
  import.add_frame_times(0);
  import.add_frame_times(1.5);
  import.set_pattern("liquid.*");
  const ingest::ImportOptions read = ToImportOptions(import);
  EXPECT_EQ(read.format, ingest::Format::kMantaflow);
  EXPECT_EQ(read.frames_per_second, 30);
  EXPECT_EQ(read.vertex_scale, 2);
  EXPECT_EQ(read.velocity_scale, 3);
  EXPECT_EQ(read.voxel_size_m, 4);
  EXPECT_TRUE(read.allow_gaps);
  EXPECT_EQ(read.up, mesh::Up::kMinusZ);
  EXPECT_EQ(read.frame_times, (std::vector<double>{0, 1.5}));
  EXPECT_EQ(read.pattern, "liquid.*");
  import.set_format(store::v1::ImportOptions::STL);
  EXPECT_EQ(ToImportOptions(import).format, ingest::Format::kStl);
  import.set_format(store::v1::ImportOptions::VDB);
  EXPECT_EQ(ToImportOptions(import).format, ingest::Format::kVdb);
}

TEST(JobOptions, ZeroOfAnOptionalFieldIsAValue) {
  store::v1::SpaceTimeOptions record;
  record.set_connectivity(store::v1::TRACKED);
  record.set_droplet_vertices(0);
  record.set_sheet_thickness_edges(0);
  record.set_keep_thin_sheets(false);
  record.set_coarser_levels(0);
  const spacetime::BuildOptions options = ToBuildOptions(record);
  EXPECT_EQ(options.connectivity, spacetime::Connectivity::kTracked);
  EXPECT_EQ(options.droplet_vertices, 0);
  EXPECT_EQ(options.sheet_thickness_edges, 0);
  EXPECT_FALSE(options.keep_thin_sheets);
  record.clear_keep_thin_sheets();
  EXPECT_TRUE(ToBuildOptions(record).keep_thin_sheets);
  EXPECT_EQ(NumCoarserLevels(record), 0);
}

TEST(JobOptions, EachLevelHasAGridOfSqrtTwoTheSpacingOfTheOneBefore) {
  store::v1::SpaceTimeOptions record;
  record.set_connectivity(store::v1::TRACKED);
  record.set_spacing_edges(0.5);
  EXPECT_EQ(ToLevelOptions(record, 0).spacing_edges, 0.5);
  EXPECT_EQ(ToLevelOptions(record, 0).connectivity, spacetime::Connectivity::kTracked);
  EXPECT_NEAR(ToLevelOptions(record, 1).spacing_edges, 0.70711, 1e-5);
  EXPECT_EQ(ToLevelOptions(record, 2).spacing_edges, 1.0);
  EXPECT_EQ(ToLevelOptions(record, 2).connectivity, spacetime::Connectivity::kRebuilt);
}

TEST(JobOptions, CheckNamesTheFirstFieldOutOfRangeAndItsValue) {
  const auto message = [](const std::function<void(store::v1::RegisterJob&)>& change) {
    store::v1::RegisterJob job;
    change(job);
    return std::string(CheckOptions(job).message());
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_EQ(message([](auto& job) { job.mutable_space_time()->set_coarser_levels(7); }),
            "coarser_levels is 7, not in [0, 6]");
  EXPECT_EQ(message([](auto& job) { job.mutable_space_time()->set_coarser_levels(6); }),
            "level of detail 6: spacing_edges is 7.2, not in [0.25, 4]");
  EXPECT_EQ(message([](auto& job) { job.mutable_space_time()->set_droplet_vertices(-1); }),
            "droplet_vertices is -1, not in [0, 10000]");
  EXPECT_EQ(message([](auto& job) { job.mutable_options()->set_thin_sheets_from(1.5); }),
            "thin_sheets_from is 1.5, not in [0, 1]");
}

TEST(JobOptions, SecondsOfCorrespondencesBecomeFrames) {
  store::v1::RegisterJob job;
  job.add_correspondences();
  store::v1::Correspondence& record = *job.add_correspondences()->add_correspondences();
  record.set_kind(store::v1::Correspondence::TRAJECTORY);
  record.set_hard(true);
  for (const double x : {1.0, 2.0, 3.0, 0.5}) record.add_source(x);
  for (const double x : {4.0, 5.0, 6.0, 1.0}) record.add_target(x);
  record.set_length_s(0.25);
  EXPECT_TRUE(ToCorrespondences(job, 0, 24).empty());
  EXPECT_TRUE(ToCorrespondences(job, 2, 24).empty());
  const auto correspondences = ToCorrespondences(job, 1, 24);
  ASSERT_EQ(correspondences.size(), 1U);
  EXPECT_EQ(correspondences[0].kind, registration::CorrespondenceKind::kTrajectory);
  EXPECT_TRUE(correspondences[0].hard);
  EXPECT_EQ(correspondences[0].source, Eigen::Vector4d(1, 2, 3, 12));
  EXPECT_EQ(correspondences[0].target, Eigen::Vector4d(4, 5, 6, 24));
  EXPECT_EQ(correspondences[0].length_frames, 6);
}

}  // namespace
}  // namespace liquidblend::jobs
