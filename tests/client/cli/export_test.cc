// `liquidblend export` and the folder that it writes into, with a server of canned answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/export_meta.h"
#include "tests/client/fake_server.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"

namespace liquidblend::cli {
namespace {

using testing::CommandResult;
using ::testing::ElementsAre;
using testing::FakeServer;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TempDir;

class Export : public ::testing::Test {
 protected:
  CommandResult Run(const std::vector<std::string>& flags = {}, const std::string& weight = "0.5") {
    std::vector<std::string> arguments = {"--server", server_.target(), "export", "drops",
                                          "-w",       weight,           "-o",     Out()};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return testing::RunLiquidblend(arguments);
  }

  std::string Out() const { return dir_.File("out"); }
  std::vector<std::string> Names() const { return testing::ListFolder(Out()); }
  void Write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directory(Out());
    dir_.Write("out/" + name, bytes);
  }

  FakeServer server_;
  TempDir dir_;
};

TEST_F(Export, AsksForTheVersionThatSaysItsRate) {
  ASSERT_EQ(Run().exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("\nversion: 3"));
}

TEST_F(Export, OfAServerThatKnowsNoVersionsByNumberIsRefused) {
  const CommandResult result = Run({"--version", "2"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("gives version 3 instead of 2: it is too old"));
  EXPECT_FALSE(std::filesystem::exists(Out()));
}

TEST_F(Export, RefusesAFolderThatHoldsAnything) {
  Write("notes.txt", "mine");
  const CommandResult result = Run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("out: the folder is not empty, it holds notes.txt; choose "));
  EXPECT_THAT(result.err, HasSubstr("--overwrite"));
  EXPECT_THAT(Names(), ElementsAre("notes.txt"));
}

TEST_F(Export, OverwriteReplacesTheFramesOfEveryFormatAndNothingElse) {
  for (const char* name : {"frame_0001.obj", "frame_0009.ply", "frame_10000.ply",
                           "fluid_mesh_0002.bobj.gz", "meta.json", "frame_0001.png", "notes.txt"}) {
    Write(name, "before");
  }
  const CommandResult result = Run({"--overwrite", "--fps", "2"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(Names(), ElementsAre("frame_0001.ply", "frame_0001.png", "frame_0002.ply",
                                   "frame_0003.ply", "meta.json", "notes.txt"));
  EXPECT_THAT(testing::ReadBytes(Out() + "/meta.json"), HasSubstr("\"fps\": 2.0"));
  EXPECT_EQ(testing::ReadBytes(Out() + "/notes.txt"), "before");
  EXPECT_EQ(testing::ReadBytes(Out() + "/frame_0001.png"), "before");
}

TEST_F(Export, OverwriteRefusesFilesThatAnImportWouldMixWithTheFrames) {
  for (const char* name : {"foam.0001.ply", "lVelMesh_0001.uni", "frame_001.ply", "a_1.OBJ"}) {
    Write("frame_0001.ply", "before");
    Write(name, "other");
    const CommandResult result = Run({"--overwrite"});
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_THAT(result.err, HasSubstr(std::string("holds ") + name));
    EXPECT_EQ(testing::ReadBytes(Out() + "/frame_0001.ply"), "before");
    std::filesystem::remove_all(Out());
  }
}

TEST_F(Export, ThatBreaksOffLeavesTheFormerFramesAndNoTrace) {
  ASSERT_EQ(Run({"--fps", "2"}).exit_code, 0);
  const std::vector<std::string> before = Names();
  const std::string first = testing::ReadBytes(Out() + "/frame_0001.ply");
  server_.BreakNextStream();
  const CommandResult broken = Run({"--overwrite", "--format", "obj"}, "0.75");
  EXPECT_EQ(broken.exit_code, 3) << broken.err;
  EXPECT_EQ(Names(), before);
  EXPECT_EQ(testing::ReadBytes(Out() + "/frame_0001.ply"), first);
}

TEST_F(Export, ThatBreaksOffLeavesANewFolderEmpty) {
  server_.BreakNextStream();
  EXPECT_EQ(Run().exit_code, 3);
  EXPECT_THAT(Names(), IsEmpty());
  EXPECT_EQ(Run().exit_code, 0);
}

TEST_F(Export, RemovesTheRestOfAnExportThatWasKilled) {
  std::filesystem::create_directories(Out() + "/.export.part");
  dir_.Write("out/.export.part/frame_0001.ply", "half");
  EXPECT_THAT(Run().err, HasSubstr("holds .export.part"));
  ASSERT_EQ(Run({"--overwrite", "--fps", "1"}).exit_code, 0);
  EXPECT_THAT(Names(), ElementsAre("frame_0001.ply", "frame_0002.ply", "meta.json"));
}

TEST(ToMetaJson, SaysRateAndUnitsAndTimesOnlyWhereTheyAreNotWholeFrames) {
  const auto parse = [](const ExportMeta& meta) { return nlohmann::json::parse(ToMetaJson(meta)); };
  const double rate = 23.976;
  nlohmann::json json = parse({rate, {0, 1 / rate, 2 / rate}, "families/f", 3, {0.25, -0.5}});
  EXPECT_EQ(json["fps"], rate);
  EXPECT_FALSE(json.contains("frame_times"));
  EXPECT_FALSE(json.contains("up"));
  EXPECT_EQ(json["units"]["vertex_scale"], 1);
  EXPECT_EQ(json["units"]["velocity_scale_to_m_per_s"], 1);
  EXPECT_EQ(json["about"]["version"], 3);
  EXPECT_EQ(json["about"]["weights"], nlohmann::json({0.25, -0.5}));
  json = parse({24, {0.5, 0.5 + 1.5 / 24, 0.5 + 4.0 / 24}, "families/f", 1, {}});
  EXPECT_EQ(json["frame_times"], nlohmann::json({0.0, 1.5, 4.0}));
  EXPECT_EQ(parse({24, {0}, "families/f", 1, {}, Up::kMinusY})["up"], "-y");
}

}  // namespace
}  // namespace liquidblend::cli
