#include "server/http/exchange/requests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/store/store_testing.h"

namespace liquidblend::http {
namespace {

using store::Fails;
using testing::ElementsAre;

const auto kInvalid = absl::StatusCode::kInvalidArgument;

absl::StatusOr<v1::GetFrameRequest> Frame(const std::string& query) {
  return ToGetFrame("splash", *transcode::ParseQuery(query));
}

TEST(ToGetFrame, ReadsEveryField) {
  const auto request = Frame(
      "weights=0.5,-0.25&time=1.25&version=7&min_version=6&preset=smallest&"
      "position_bits=12&level_of_detail=1&"
      "smoothing_passes=3&smoothing=laplacian&smoothing_strength=0.7&temporal_smoothing=1&"
      "attributes=normals,velocities&extrapolate=true");
  ASSERT_TRUE(request.ok()) << request.status();
  EXPECT_EQ(request->family(), "families/splash");
  EXPECT_THAT(request->weights(), ElementsAre(0.5, -0.25));
  EXPECT_EQ(request->time_s(), 1.25);
  EXPECT_EQ(request->version(), 7);
  EXPECT_EQ(request->min_version(), 6);
  EXPECT_EQ(request->encoding().preset(), v1::Encoding::SMALLEST);
  EXPECT_EQ(request->encoding().position_bits(), 12);
  EXPECT_EQ(request->surface().level_of_detail(), 1);
  EXPECT_EQ(request->surface().smoothing_passes(), 3);
  EXPECT_EQ(request->surface().smoothing(), v1::SurfaceOptions::LAPLACIAN);
  EXPECT_EQ(request->surface().smoothing_strength(), 0.7);
  EXPECT_EQ(request->surface().temporal_smoothing(), 1.0);
  EXPECT_THAT(request->surface().attributes(),
              ElementsAre(v1::SurfaceOptions::NORMALS, v1::SurfaceOptions::VELOCITIES));
  EXPECT_TRUE(request->extrapolate());
  EXPECT_EQ(Frame("position_step=0.0002")->encoding().position_step_m(), 0.0002);
}

TEST(ToGetFrame, ReadsAPointInParameterSpace) {
  const auto request = Frame("parameters=height%3D1.5,width=-2e-1");
  ASSERT_TRUE(request.ok()) << request.status();
  ASSERT_EQ(request->parameters_size(), 2);
  EXPECT_EQ(request->parameters(0).name(), "height");
  EXPECT_EQ(request->parameters(0).value(), 1.5);
  EXPECT_EQ(request->parameters(1).name(), "width");
  EXPECT_EQ(request->parameters(1).value(), -0.2);
}

TEST(ToGetFrame, NamesEveryFieldAtFault) {
  for (const auto& [query, words] : std::vector<std::pair<std::string, std::string>>{
           {"weights=", "weights: must be a finite number, got ''"},
           {"weights=0.5,x", "weights: must be a finite number"},
           {"time=nan", "time: must be a finite number, got 'nan'"},
           {"time=inf", "time: must be a finite number"},
           {"version=0", "version: must be the number of a version"},
           {"min_version=0", "min_version: must be the number of a version"},
           {"version=latest", "version: must be the number of a version"},
           {"preset=best", "preset: must be fastest, balanced or smallest, got 'best'"},
           {"preset=preset_unspecified", "preset: must be"},
           {"position_bits=1.5", "position_bits: must be a whole number"},
           {"position_step=thin", "position_step: must be a finite number, got 'thin'"},
           {"level_of_detail=99999999999", "level_of_detail: must be a whole number"},
           {"smoothing=gauss", "smoothing: must be laplacian or taubin"},
           {"attributes=normals,colors", "attributes: must be normals"},
           {"extrapolate=maybe", "extrapolate: must be true or false"},
           {"parameters=height", "parameters: must be NAME=VALUE"},
           {"parameters=height=tall", "parameters: must be a finite number"},
           {"wieghts=1", "wieghts: is not a field of this query"}}) {
    EXPECT_THAT(Frame(query), Fails(kInvalid, words)) << query;
  }
  const auto both = Frame("time=x&preset=y");
  EXPECT_THAT(both, Fails(kInvalid, "time: "));
  EXPECT_THAT(both, Fails(kInvalid, "preset: "));
}

}  // namespace
}  // namespace liquidblend::http
