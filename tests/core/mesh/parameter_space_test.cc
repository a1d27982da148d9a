#include "core/mesh/parameter_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace liquidblend::mesh::parameter_space_test {
namespace {

using testing::HasSubstr;

void ExpectFault(const ParameterSpace& space, const std::string& what) {
  const absl::Status status = Validate(space, 3);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr(what));
}

TEST(ParameterSpace, IsEmptyOrHasAPointPerAnimation) {
  EXPECT_TRUE(Validate(ParameterSpace(), 3).ok());
  const ParameterSpace space = {{"wall_width", "p1"}, {{0, 1}, {-2, 3}, {4, 1e300}}};
  EXPECT_TRUE(Validate(space, 3).ok());
  ExpectFault({{"x"}, {{0}, {1}}}, "2 points for 3 animations; each of them needs one");
  ExpectFault({{}, {{}, {}, {}}}, "there must be 1 to 4 names, got 0");
}

TEST(ParameterSpace, NamesTheFirstFault) {
  const std::vector<std::vector<double>> points = {{0, 1}, {2, 3}, {4, 1}};
  ExpectFault({{"a", "b", "c", "d", "e"}, points}, "1 to 4 names, got 5");
  ExpectFault({{"a", "a"}, points}, "the name 'a' is given twice");
  for (const char* name : {"", "Wall", "wall width", "1st", "_a", "a=b"}) {
    ExpectFault({{"a", name}, points}, "does not match [a-z][a-z0-9_]{0,62}");
  }
  ExpectFault({{std::string(64, 'a')}, points}, "does not match");
  ExpectFault({{"a", "b"}, {{0, 1}, {2}, {4, 1}}}, "points[1] has 1 values for 2 names");
  ExpectFault({{"a", "b"}, {{0, 1}, {2, 3}, {4, std::numeric_limits<double>::infinity()}}},
              "points[2]: b is inf, not finite");
}

TEST(ParameterSpace, HasAnInterpolationThatIsKnown) {
  ParameterSpace space = {{"x"}, {{0}, {1}, {2}}, Interpolation::kSmooth};
  EXPECT_TRUE(Validate(space, 3).ok());
  space.interpolation = static_cast<Interpolation>(7);
  ExpectFault(space, "interpolation 7 is neither linear nor smooth");
}

}  // namespace
}  // namespace liquidblend::mesh::parameter_space_test
