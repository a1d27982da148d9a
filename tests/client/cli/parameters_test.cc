// The command's flags for points in parameter space, against a server with canned answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/client/cli/served_command.h"

namespace liquidblend::cli {
namespace {

using nlohmann::json;
using testing::CommandResult;
using ::testing::HasSubstr;
using ::testing::Not;

class ParametersCommand : public ServedCommand {};

TEST_F(ParametersCommand, RegisterSendsAPointPerAnimation) {
  const CommandResult result =
      Run({"register", "drops", "--source", "drops-a", "--target", "drops-b", "--at",
           "drops-b:height=3.5", "--at", "drops-a:height=-1.5"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      server_.LastRequest(),
      HasSubstr("parameter_space {\n  names: \"height\"\n  points {\n    values: -1.5\n  }\n"
                "  points {\n    values: 3.5\n  }\n}"));
  const CommandResult missing = Run({"register", "drops", "--source", "drops-a", "--target",
                                     "drops-b", "--at", "drops-a:height=1"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("--at is missing for 'drops-b'"));
}

TEST_F(ParametersCommand, RegisterSendsHowPointsAreInterpolated) {
  const CommandResult registered =
      Run({"register", "drops", "--source", "drops-a", "--target", "drops-b", "--at",
           "drops-b:height=3.5", "--at", "drops-a:height=-1.5", "--interpolation", "smooth"});
  ASSERT_EQ(registered.exit_code, 0) << registered.err;
  EXPECT_THAT(server_.LastRequest(), HasSubstr("    values: 3.5\n  }\n  interpolation: SMOOTH\n}"));
  ASSERT_EQ(Run({"register", "drops", "--refine", "--interpolation", "linear"}).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("parameter_space {\n  interpolation: LINEAR\n}"));
  EXPECT_THAT(Run({"register", "drops", "--refine", "--interpolation", "cubic"}).err,
              HasSubstr("--interpolation: 'cubic' is not one of linear, smooth"));
}

TEST_F(ParametersCommand, RegisterSendsHowTimesBlend) {
  const auto request = [&](std::vector<std::string> flags) {
    flags.insert(flags.begin(),
                 {"register", "drops", "--source", "drops-a", "--target", "drops-b"});
    EXPECT_EQ(Run(flags).exit_code, 0);
    return server_.LastRequest();
  };
  EXPECT_THAT(request({}), Not(HasSubstr("time_blending")));
  EXPECT_THAT(request({"--time-blending", "linear"}),
              HasSubstr("time_blending {\n  kind: LINEAR\n}"));
  EXPECT_THAT(request({"--time-blending", "auto"}),
              HasSubstr("time_blending {\n  kind: AUTOMATIC\n}"));
  EXPECT_THAT(request({"--time-blending", "squares", "--rest-time", "-0.5"}),
              HasSubstr("time_blending {\n  kind: SQUARES\n  rest_time_s: -0.5\n}"));
  EXPECT_EQ(Run({"register", "drops", "--time-blending", "cubes"}).exit_code, 2);
}

TEST_F(ParametersCommand, InspectTellsHowTimesBlend) {
  EXPECT_THAT(Run({"inspect", "drops"}).out,
              HasSubstr("\n  times blend as squares of those since -0.5 s (both fall)\n"));
  const json blending = json::parse(Run({"inspect", "drops", "--json"}).out)["timeBlending"];
  EXPECT_EQ(blending, json({{"kind", "SQUARES"}, {"restTimeS", -0.5}, {"reason", "both fall"}}));
  EXPECT_THAT(Run({"inspect", "families/empty"}).out, Not(HasSubstr("squares")));
}

TEST_F(ParametersCommand, RegisterWithoutPointsSendsNone) {
  ASSERT_EQ(Run({"register", "drops", "--source", "drops-a", "--target", "drops-b"}).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("parameter_space")));
}

TEST_F(ParametersCommand, InspectTellsThePoints) {
  EXPECT_THAT(Run({"inspect", "drops"}).out,
              HasSubstr("\n  animations/drops-a at height 1\n  animations/drops-b at height 3\n"
                        "  weights between these points are interpolated smoothly\n"));
  const json space = json::parse(Run({"inspect", "drops", "--json"}).out)["parameterSpace"];
  EXPECT_EQ(space["names"], json({"height"}));
  EXPECT_EQ(space["points"][1]["values"], json({3.0}));
  EXPECT_EQ(space["interpolation"], "SMOOTH");
  EXPECT_FALSE(
      json::parse(Run({"inspect", "families/empty", "--json"}).out).contains("parameterSpace"));
}

TEST_F(ParametersCommand, FrameTakesAPointAndTellsItsWeights) {
  std::vector<std::string> frame = {"frame", "drops", "-t", "0", "-o", dir_.File("f.drc"),
                                    "--json"};
  const auto run = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = frame;
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return Run(arguments);
  };
  const CommandResult inside = run({"--parameters", "height=2.5"});
  ASSERT_EQ(inside.exit_code, 0) << inside.err;
  EXPECT_EQ(json::parse(inside.out)["weights"], json({0.75}));
  EXPECT_EQ(json::parse(inside.out)["extrapolated"], false);
  const CommandResult refused = run({"--parameters", "height=4"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("outside of the hull"));
  const CommandResult outside = run({"-p", "height=4", "--extrapolate"});
  ASSERT_EQ(outside.exit_code, 0) << outside.err;
  EXPECT_EQ(json::parse(outside.out)["extrapolated"], true);
  EXPECT_EQ(json::parse(outside.out)["clamped"], false);
  const CommandResult clamped = run({"-w", "-0.75"});
  ASSERT_EQ(clamped.exit_code, 0) << clamped.err;
  EXPECT_EQ(json::parse(clamped.out)["clamped"], true);
  EXPECT_EQ(run({"-p", "height=2", "-w", "0.5"}).exit_code, 2);
  EXPECT_EQ(run({"-w", "0.5", "--extrapolate"}).exit_code, 2);
  EXPECT_THAT(run({}).err, HasSubstr("either --weights W[,W..] or --parameters"));
}

TEST_F(ParametersCommand, ExportTellsTheWeightsOfItsPoint) {
  const CommandResult result =
      Run({"export", "drops", "-p", "height=1.5", "--fps", "4", "-o", dir_.File("out"), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["num_files"], 5);
  EXPECT_EQ(json::parse(result.out)["weights"], json({0.25}));
  EXPECT_EQ(Run({"export", "drops", "-o", dir_.File("out")}).exit_code, 2);
}

TEST_F(ParametersCommand, StreamPlaysAPoint) {
  const CommandResult result =
      Run({"stream", "drops", "-p", "height=1.5", "--seconds", "1", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_GT(json::parse(result.out)["num_frames"], 1);
  EXPECT_EQ(Run({"stream", "drops", "-p", "height=1.5", "--sweep"}).exit_code, 2);
}

TEST_F(ParametersCommand, RenderDrawsARowPerPoint) {
  const CommandResult result =
      Run({"render", "drops", "-p", "height=1", "-p", "height=4", "--extrapolate", "--times", "0,1",
           "--size", "64x48", "--samples", "1", "-o", dir_.File("sheet.png")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(server_.NumCalls("GetFrame"), 4);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("name: \"height\"\n  value: 4"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("extrapolate: true"));
}

}  // namespace
}  // namespace liquidblend::cli
