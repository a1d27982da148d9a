#include "server/api/api_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace liquidblend::server {
namespace {

using testing::ElementsAre;

TEST(ToFamily, TellsWhatBecameOfItsCorrespondences) {
  store::pb::FamilyRecord record;
  store::pb::CorrespondenceReport& report =
      *record.mutable_manifest()->add_reports()->add_correspondences();
  report.mutable_correspondence()->set_kind(store::pb::Correspondence::TRAJECTORY);
  for (const double value : {1.0, 2.0, 3.0, 0.5}) {
    report.mutable_correspondence()->add_source(value);
    report.mutable_correspondence()->add_target(2 * value);
  }
  report.set_residual_m(0.25);
  report.set_residual_frames(1.5);
  report.set_num_nodes(4);
  report.set_overruled(true);
  report.set_automatic(true);
  report.set_confidence(0.75);
  const v1::CorrespondenceReport told = ToFamily(record).reports(0).correspondences(0);
  EXPECT_EQ(told.outcome(), v1::CorrespondenceReport::OVERRULED);
  EXPECT_EQ(told.correspondence().kind(), v1::Correspondence::TRAJECTORY);
  EXPECT_EQ(told.correspondence().source().time_s(), 0.5);
  EXPECT_EQ(told.correspondence().target().position().z(), 6);
  EXPECT_EQ(told.residual_m(), 0.25);
  EXPECT_EQ(told.residual_frames(), 1.5);
  EXPECT_EQ(told.num_nodes(), 4);
  EXPECT_TRUE(told.automatic());
  EXPECT_EQ(told.confidence(), 0.75);
}

TEST(ToFamily, TellsTheVerdict) {
  store::pb::FamilyRecord record;
  record.mutable_manifest()->set_frames_per_second(24);
  store::pb::RegistrationReport& report = *record.mutable_manifest()->add_reports();
  store::pb::Verdict& stored = *report.mutable_verdict();
  stored.set_grade(store::pb::TOO_DIFFERENT);
  stored.set_reason("all of it");
  for (const double number : {1, 2, 3, 12}) stored.add_worst(number);
  stored.add_residual_histogram(0.5);
  stored.set_covered_share(0.25);
  stored.set_unmatched_share(0.75);
  record.mutable_manifest()->add_reports();  // of an older program
  const v1::Family family = ToFamily(record);
  ASSERT_EQ(family.reports_size(), 2);
  const v1::Verdict& verdict = family.reports(0).verdict();
  EXPECT_EQ(verdict.grade(), v1::Verdict::TOO_DIFFERENT);
  EXPECT_EQ(verdict.reason(), "all of it");
  EXPECT_EQ(verdict.worst().position().y(), 2);
  EXPECT_DOUBLE_EQ(verdict.worst().time_s(), 0.5);
  EXPECT_THAT(verdict.residual_histogram(), ElementsAre(0.5));
  EXPECT_EQ(verdict.covered_share(), 0.25);
  EXPECT_EQ(verdict.unmatched_share(), 0.75);
  EXPECT_FALSE(family.reports(1).has_verdict());
}

TEST(ToFamily, TellsWhatTheSpaceTimeMeshesAreLike) {
  store::pb::FamilyRecord record;
  record.set_id("splash");
  store::pb::FamilyManifest& manifest = *record.mutable_manifest();
  manifest.set_source("a");
  manifest.add_targets("b");
  store::pb::SpaceTimeReport& source = *manifest.add_space_time_reports();
  source.set_connectivity(store::pb::REBUILT);
  source.set_grid_spacing_m(0.09);
  source.set_edge_length_m(0.1);
  source.set_num_wedges(12);
  source.set_num_droplets(2);
  source.set_thin_share(0.25);
  source.mutable_fidelity()->set_max_distance_edges(0.5);
  source.mutable_fidelity()->set_max_component_error(1);
  manifest.add_space_time_reports()->set_connectivity(store::pb::TRACKED);
  const v1::Family family = ToFamily(record);
  ASSERT_EQ(family.space_time_reports_size(), 2);
  const v1::SpaceTimeReport& report = family.space_time_reports(0);
  EXPECT_EQ(report.animation(), "animations/a");
  EXPECT_EQ(report.connectivity(), v1::REBUILT);
  EXPECT_DOUBLE_EQ(report.grid_spacing_edges(), 0.9);
  EXPECT_EQ(report.num_wedges(), 12);
  EXPECT_EQ(report.num_droplets(), 2);
  EXPECT_EQ(report.thin_share(), 0.25);
  EXPECT_EQ(report.fidelity().max_distance_edges(), 0.5);
  EXPECT_EQ(report.fidelity().max_component_error(), 1);
  EXPECT_EQ(family.space_time_reports(1).animation(), "animations/b");
  EXPECT_EQ(family.space_time_reports(1).connectivity(), v1::TRACKED);
}

}  // namespace
}  // namespace liquidblend::server
