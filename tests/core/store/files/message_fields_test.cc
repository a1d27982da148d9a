// Names of figures and options are those of the messages.
#include "core/store/files/message_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "core/mesh/registered_family.h"
#include "core/mesh/registration_options.h"
#include "liquidblend/store/v1/records.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::store::message_fields_test {
namespace {

using google::protobuf::FieldDescriptor;
using testing::ElementsAre;
using testing::UnorderedElementsAreArray;

template <typename Report>
std::vector<std::string> FiguresOf() {
  std::vector<std::string> names;
  Report report;
  Report::ForEachFigure(report, [&](const char* name, const auto&) { names.emplace_back(name); });
  return names;
}

// The fields that are numbers, or lists of numbers, but for `special` ones.
template <typename M>
std::vector<std::string> NumbersOf(const std::string& special = "") {
  std::vector<std::string> names;
  for (int n = 0; n < M::descriptor()->field_count(); ++n) {
    const FieldDescriptor& field = *M::descriptor()->field(n);
    const bool is_number = field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE &&
                           field.cpp_type() != FieldDescriptor::CPPTYPE_ENUM &&
                           field.cpp_type() != FieldDescriptor::CPPTYPE_STRING;
    if (is_number && field.name() != special) names.push_back(field.name());
  }
  return names;
}

TEST(Figures, AreAllNumbersOfTheMessages) {
  using mesh::Verdict, mesh::RegistrationReport, mesh::SpaceTimeReport, mesh::Fidelity;
  namespace api = liquidblend::v1;
  EXPECT_THAT(FiguresOf<Verdict>(), UnorderedElementsAreArray(NumbersOf<v1::Verdict>("worst")));
  EXPECT_THAT(FiguresOf<Verdict>(), UnorderedElementsAreArray(NumbersOf<api::Verdict>()));
  EXPECT_THAT(FiguresOf<RegistrationReport>(),
              UnorderedElementsAreArray(NumbersOf<v1::RegistrationReport>()));
  EXPECT_THAT(FiguresOf<SpaceTimeReport>(),
              UnorderedElementsAreArray(NumbersOf<v1::SpaceTimeReport>()));
  EXPECT_THAT(FiguresOf<SpaceTimeReport>(),
              UnorderedElementsAreArray(NumbersOf<api::SpaceTimeReport>("grid_spacing_edges")));
  EXPECT_THAT(FiguresOf<Fidelity>(), UnorderedElementsAreArray(NumbersOf<v1::Fidelity>()));
  EXPECT_THAT(FiguresOf<Fidelity>(), UnorderedElementsAreArray(NumbersOf<api::Fidelity>()));
}

TEST(RegistrationOptions, AreAllFieldsOfTheMessages) {
  std::vector<std::string> names;
  const mesh::RegistrationOptions options;
  mesh::RegistrationOptions::ForEach(options, [&](const mesh::OptionInfo& info, const auto&...) {
    names.emplace_back(info.name);
  });
  EXPECT_THAT(names, UnorderedElementsAreArray(NumbersOf<v1::RegistrationOptions>()));
  EXPECT_THAT(names, UnorderedElementsAreArray(NumbersOf<liquidblend::v1::RegistrationOptions>()));
}

// A field gives back what was written, and is what the message's own function reads.
template <typename T, typename M>
void ExpectGivesBack(const char* name, T value, T (M::*read)() const) {
  M message;
  T got = T();
  EXPECT_FALSE(GetField(name, message, got));
  SetField(name, value, message);
  EXPECT_EQ((message.*read)(), value);
  EXPECT_TRUE(GetField(name, message, got));
  EXPECT_EQ(got, value);
}

TEST(MessageFields, GiveBackWhatWasWritten) {
  using Options = v1::RegistrationOptions;
  ExpectGivesBack<int32_t>("max_iterations", -7, &Options::max_iterations);
  ExpectGivesBack<uint64_t>("seed", ~uint64_t{0}, &Options::seed);
  ExpectGivesBack<double>("sample_share", 0.25, &Options::sample_share);
  ExpectGivesBack<bool>("automatic_correspondences", true, &Options::automatic_correspondences);
  ExpectGivesBack<int64_t>("num_wedges", int64_t{1} << 40, &v1::SpaceTimeReport::num_wedges);
}

TEST(MessageFields, TellZeroFromNothingOnlyWhereThatIsOptional) {
  v1::RegistrationOptions message;
  message.set_automatic_correspondences(false);
  message.set_max_iterations(0);
  bool is_on = true;
  int32_t iterations = 16;
  EXPECT_TRUE(GetField("automatic_correspondences", message, is_on));
  EXPECT_FALSE(is_on);
  EXPECT_FALSE(GetField("max_iterations", message, iterations));
  EXPECT_EQ(iterations, 16);
}

TEST(MessageFields, ReadListsAsFarAsThereIsRoom) {
  v1::Verdict message;
  const std::array<double, 3> written = {1, 2, 3};
  SetField("volume_errors", written, message);
  SetField("volume_errors", written, message);  // replaces
  EXPECT_THAT(message.volume_errors(), ElementsAre(1, 2, 3));
  std::array<double, 2> small = {};
  EXPECT_TRUE(GetField("volume_errors", message, small));
  EXPECT_THAT(small, ElementsAre(1, 2));
  std::array<double, 4> large = {0, 0, 0, 9};
  EXPECT_TRUE(GetField("volume_errors", message, large));
  EXPECT_THAT(large, ElementsAre(1, 2, 3, 9));
  std::vector<double> all = {7};
  EXPECT_FALSE(GetField("residual_histogram", message, all));
  EXPECT_THAT(all, ElementsAre(7));
  EXPECT_TRUE(GetField("volume_errors", message, all));
  EXPECT_THAT(all, ElementsAre(1, 2, 3));
}

}  // namespace
}  // namespace liquidblend::store::message_fields_test
