// `liquidblend export` in formats that hold all frames in few files, and along curves, with a
// server of canned answers: an octahedron of radius 1 + weight about (time, 0, 0). Whether other
// programs read the files is tested in tests/e2e/web.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "tests/client/fake_server.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"

namespace liquidblend::cli {
namespace {

using Json = ::nlohmann::json;
using testing::CommandResult;
using ::testing::HasSubstr;

class ExportFormats : public ::testing::Test {
 protected:
  CommandResult Run(const std::vector<std::string>& flags, const std::string& weights = "0.5") {
    std::vector<std::string> arguments = {"--server", server_.target(), "export", "drops", "-o",
                                          Out()};
    if (!weights.empty()) arguments.insert(arguments.end(), {"-w", weights});
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return testing::RunLiquidblend(arguments);
  }

  std::string Out() const { return dir_.File("out"); }
  std::string Read(const std::string& name) const { return testing::ReadBytes(Out() + "/" + name); }

  // The largest coordinate y of an exported frame: 1 + weight.
  double RadiusOf(int number) const {
    const auto mesh = ReadMeshFile(absl::StrCat(Out(), "/frame_000", number, ".ply"));
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? ComputeMeshStats(*mesh).bounds.max.y : 0.0;
  }

  testing::FakeServer server_;
  testing::TempDir dir_;
};

TEST_F(ExportFormats, FramesAlongACurveHaveTheWeightsOfTheirTimes) {
  const CommandResult result = Run({"--fps", "4"}, "0.25:0/0.75:1");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("weights 0 to 1 along a curve"));
  EXPECT_EQ(server_.NumCalls("GetFrame"), 5);
  const double radii[] = {1, 1, 1.5, 2, 2};
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(RadiusOf(k + 1), radii[k], 1e-4) << k;
  EXPECT_EQ(Json::parse(Read("meta.json"))["about"]["weights"],
            Json::parse("[[0.0], [0.0], [0.5], [1.0], [1.0]]"));
  EXPECT_THAT(server_.LastRequest(), AllOf(HasSubstr("version: 3"), HasSubstr("time_s: 1\n")));
}

TEST_F(ExportFormats, ACurveOfParametersIsAsGood) {
  const CommandResult result =
      Run({"--fps", "2", "-p", "0:height=1/1:height=5", "--extrapolate"}, "");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(RadiusOf(k + 1), 1 + k, 1e-4);
}

TEST_F(ExportFormats, AWrongCurveIsRefusedBeforeAnythingIsWritten) {
  const CommandResult result = Run({}, "0:0/0.5:x");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("key 2: --weights x: \"x\" is not a number"));
  EXPECT_EQ(server_.NumCalls("GetFamily"), 0);
}

}  // namespace
}  // namespace liquidblend::cli
