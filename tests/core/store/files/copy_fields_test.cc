#include "core/store/files/copy_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "liquidblend/store/v1/records.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::store::copy_fields_test {
namespace {

using google::protobuf::Descriptor;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

// Paths of the fields of `from` that have no twin, messages within messages included.
void AddUncopied(const Descriptor& from, const Descriptor& to, const std::string& prefix,
                 std::vector<std::string>& paths) {
  if (&from == &to) return;
  for (int n = 0; n < from.field_count(); ++n) {
    const auto& field = *from.field(n);
    const auto* twin = FindTwin(field, to);
    if (twin == nullptr) {
      paths.push_back(prefix + field.name());
    } else if (field.message_type() != nullptr) {
      AddUncopied(*field.message_type(), *twin->message_type(), prefix + field.name() + ".", paths);
    }
  }
}

template <typename From, typename To>
std::vector<std::string> Uncopied() {
  std::vector<std::string> paths;
  AddUncopied(*From::descriptor(), *To::descriptor(), "", paths);
  return paths;
}

template <typename Api, typename Record>
void ExpectTheSame() {
  EXPECT_THAT((Uncopied<Api, Record>()), IsEmpty());
  EXPECT_THAT((Uncopied<Record, Api>()), IsEmpty());
}

TEST(CopyFields, LeavesNothingOfOptionsOut) {
  ExpectTheSame<liquidblend::v1::ImportOptions, v1::ImportOptions>();
  ExpectTheSame<liquidblend::v1::RegistrationOptions, v1::RegistrationOptions>();
  ExpectTheSame<liquidblend::v1::SpaceTimeOptions, v1::SpaceTimeOptions>();
  EXPECT_THAT((Uncopied<liquidblend::v1::ParameterSpace, v1::ParameterSpace>()),
              ElementsAre("simplices"));
  EXPECT_THAT((Uncopied<v1::ParameterSpace, liquidblend::v1::ParameterSpace>()), IsEmpty());
}

// What is named here, server/api/api_messages.cc converts.
TEST(CopyFields, LeavesEventsAndNamesOfReportsOut) {
  EXPECT_THAT(
      (Uncopied<v1::RegistrationReport, liquidblend::v1::RegistrationReport>()),
      ElementsAre("correspondences.correspondence.source", "correspondences.correspondence.target",
                  "correspondences.overruled", "verdict.worst", "rest"));
  EXPECT_THAT((Uncopied<liquidblend::v1::RegistrationReport, v1::RegistrationReport>()),
              UnorderedElementsAre("correspondences.correspondence.source",
                                   "correspondences.correspondence.target",
                                   "correspondences.outcome", "verdict.worst"));
  EXPECT_THAT((Uncopied<v1::SpaceTimeReport, liquidblend::v1::SpaceTimeReport>()), IsEmpty());
  EXPECT_THAT((Uncopied<liquidblend::v1::SpaceTimeReport, v1::SpaceTimeReport>()),
              ElementsAre("animation", "grid_spacing_edges"));
  EXPECT_THAT((Uncopied<v1::JobProgress, liquidblend::v1::Progress>()),
              ElementsAre("resumed_iteration"));
}

TEST(CopyFields, CopiesEveryTypeAndEnumsByNumber) {
  v1::SpaceTimeReport record;
  record.set_connectivity(v1::REBUILT);
  record.set_grid_spacing_m(0.1);
  record.set_num_vertices(int64_t{1} << 40);
  record.mutable_fidelity()->set_num_frames(16);
  const auto report = CopyOf<liquidblend::v1::SpaceTimeReport>(record);
  EXPECT_EQ(report.connectivity(), liquidblend::v1::REBUILT);
  EXPECT_EQ(report.grid_spacing_m(), 0.1);
  EXPECT_EQ(report.num_vertices(), int64_t{1} << 40);
  EXPECT_EQ(report.fidelity().num_frames(), 16);
  liquidblend::v1::ImportOptions options;
  options.set_format(liquidblend::v1::VDB);
  options.set_allow_gaps(true);
  options.set_pattern("liquid.*");
  for (const double time : {0.0, 1.5}) options.add_frame_times(time);
  const auto copy = CopyOf<v1::ImportOptions>(options);
  EXPECT_EQ(copy.format(), v1::ImportOptions::VDB);
  EXPECT_TRUE(copy.allow_gaps());
  EXPECT_EQ(copy.pattern(), "liquid.*");
  EXPECT_THAT(copy.frame_times(), ElementsAre(0.0, 1.5));
  liquidblend::v1::RegistrationOptions seeded;
  seeded.set_seed(~uint64_t{0});
  EXPECT_EQ(CopyOf<v1::RegistrationOptions>(seeded).seed(), ~uint64_t{0});
}

TEST(CopyFields, CopiesListsOfMessages) {
  v1::ParameterSpace record;
  record.add_names("height");
  record.add_points()->add_values(1.5);
  record.add_points();
  record.set_interpolation(v1::ParameterSpace::SMOOTH);
  const auto space = CopyOf<liquidblend::v1::ParameterSpace>(record);
  EXPECT_THAT(space.names(), ElementsAre("height"));
  ASSERT_EQ(space.points_size(), 2);
  EXPECT_THAT(space.points(0).values(), ElementsAre(1.5));
  EXPECT_THAT(space.points(1).values(), IsEmpty());
  EXPECT_EQ(space.interpolation(), liquidblend::v1::ParameterSpace::SMOOTH);
}

TEST(CopyFields, KeepsWhetherAFieldIsSet) {
  liquidblend::v1::SpaceTimeOptions options;
  options.set_droplet_vertices(0);
  const auto record = CopyOf<v1::SpaceTimeOptions>(options);
  EXPECT_TRUE(record.has_droplet_vertices());
  EXPECT_FALSE(record.has_coarser_levels());
  EXPECT_FALSE(CopyOf<liquidblend::v1::RegistrationReport>(v1::RegistrationReport()).has_verdict());
}

TEST(CopyFields, ReplacesWhatHasATwinAlone) {
  liquidblend::v1::SpaceTimeReport report;
  report.set_animation("animations/a");
  report.set_num_wedges(3);
  report.mutable_fidelity()->set_num_components(5);
  v1::SpaceTimeReport record;
  record.set_num_hexahedra(7);
  CopyFields(record, report);
  EXPECT_EQ(report.animation(), "animations/a");
  EXPECT_EQ(report.num_wedges(), 0);
  EXPECT_EQ(report.num_hexahedra(), 7);
  EXPECT_FALSE(report.has_fidelity());
}

}  // namespace
}  // namespace liquidblend::store::copy_fields_test
