// `liquidblend export` and the folder that it writes into, with a server of canned answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/files/export_meta.h"
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

TEST_F(Export, SaysWhyAFolderCannotBeMade) {
  const CommandResult result =
      testing::RunLiquidblend({"--server", server_.target(), "export", "drops", "-w", "0.5", "-o",
                               dir_.File(std::string(300, 'x'))});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("File name too long; choose a folder that you may write to"));
}

TEST_F(Export, RefusesAFolderThatHoldsAnything) {
  Write("notes.txt", "mine");
  const CommandResult result = Run();
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("out: the folder is not empty, it holds notes.txt; choose "));
  EXPECT_THAT(result.err, HasSubstr("--overwrite"));
  EXPECT_THAT(Names(), ElementsAre("notes.txt"));
}

TEST_F(Export, OverwriteReplacesTheFilesOfAnEarlierExportAndNothingElse) {
  for (const std::string format : {"ply", "obj", "bobj"}) {
    ASSERT_EQ(Run({"--overwrite", "--format", format}).exit_code, 0);
    Write("frame_0001.png", "before");
    Write("notes.txt", "before");
    const CommandResult result = Run({"--overwrite", "--fps", "2"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(Names(), ElementsAre("frame_0001.ply", "frame_0001.png", "frame_0002.ply",
                                     "frame_0003.ply", "meta.json", "notes.txt"));
    EXPECT_THAT(testing::ReadBytes(Out() + "/meta.json"), HasSubstr("\"fps\": 2.0"));
    EXPECT_EQ(testing::ReadBytes(Out() + "/notes.txt"), "before");
    EXPECT_EQ(testing::ReadBytes(Out() + "/frame_0001.png"), "before");
  }
}

// Files with the names of an export's that no export has written.
TEST_F(Export, OverwriteRefusesWhatNoExportHasWritten) {
  for (const char* name :
       {"frame_0001.ply", "frame_0004.ply", "frame_0001.obj", "foam.0001.ply",
        "fluid_mesh_0001.bobj.gz", "lVelMesh_0001.uni", "frame_001.ply", "a_1.OBJ", "meta.json"}) {
    Write(name, R"({"fps": 24, "about": "mine"})");
    const CommandResult result = Run({"--overwrite"});
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_THAT(result.err, HasSubstr(std::string("holds ") + name));
    EXPECT_THAT(Names(), ElementsAre(name));
    std::filesystem::remove_all(Out());
  }
}

TEST_F(Export, OverwriteRefusesFilesBesideThoseOfAnEarlierExport) {
  ASSERT_EQ(Run({"--fps", "2"}).exit_code, 0);
  const std::string first = testing::ReadBytes(Out() + "/frame_0001.ply");
  for (const char* name : {"frame_0004.ply", "frame_0001.obj", "lVelMesh_0001.uni"}) {
    Write(name, "other");
    const std::vector<std::string> before = Names();
    const CommandResult result = Run({"--overwrite"}, "0.75");
    EXPECT_EQ(result.exit_code, 2) << name;
    EXPECT_THAT(result.err, HasSubstr(std::string("holds ") + name));
    EXPECT_EQ(Names(), before);
    EXPECT_EQ(testing::ReadBytes(Out() + "/frame_0001.ply"), first);
    std::filesystem::remove(Out() + "/" + name);
  }
}

// Some frames are at their place, meta.json is not.
TEST_F(Export, OverwriteReplacesTheFilesOfAnExportThatWasKilledAtItsEnd) {
  ASSERT_EQ(Run({"--fps", "2"}).exit_code, 0);
  std::filesystem::create_directory(Out() + "/.export.part");
  for (const char* name : {"frame_0003.ply", "meta.json"}) {
    std::filesystem::rename(Out() + "/" + name, Out() + "/.export.part/" + name);
  }
  const CommandResult result = Run({"--overwrite", "--fps", "1", "--format", "obj"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(Names(), ElementsAre("frame_0001.obj", "frame_0002.obj", "meta.json"));
}

TEST_F(Export, AsksForTheNewestVersionThatThereIs) {
  ASSERT_EQ(Run({"--fps", "1"}).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("\nversion: 3\n"));
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

TEST_F(Export, ThatCannotMoveItsFilesLosesNoneAndTheNextOneGoesOn) {
  ASSERT_EQ(Run({"--fps", "2"}).exit_code, 0);
  std::filesystem::remove(Out() + "/frame_0002.ply");
  std::filesystem::create_directories(Out() + "/frame_0002.ply/in the way");
  const CommandResult stuck = Run({"--overwrite", "--fps", "2"}, "0.75");
  EXPECT_NE(stuck.exit_code, 0);
  EXPECT_THAT(stuck.err, HasSubstr("frame_0002.ply"));
  EXPECT_THAT(stuck.err, HasSubstr("not in their place yet are in " + Out() + "/.export.part"));
  EXPECT_EQ(testing::ListFolder(Out() + "/.export.part").size(), 4u);  // three frames, meta.json
  std::filesystem::remove_all(Out() + "/frame_0002.ply");
  server_.BreakNextStream();
  EXPECT_EQ(Run({"--overwrite", "--fps", "2"}, "0.75").exit_code, 3);  // nor does this lose it
  const CommandResult again = Run({"--overwrite", "--fps", "2"}, "0.75");
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(Names(),
              ElementsAre("frame_0001.ply", "frame_0002.ply", "frame_0003.ply", "meta.json"));
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

TEST(ToMetaJson, NamesTheFilesSoThatTheyAreKnownAgain) {
  ExportMeta meta;
  meta.frames_per_second = 24;
  meta.times_s = {0};
  meta.files = {"frame_", ".ply", 12000};
  const std::optional<ExportedFiles> files = ExportedFilesIn(ToMetaJson(meta));
  ASSERT_TRUE(files.has_value());
  for (const char* name : {"frame_0001.ply", "frame_9999.ply", "frame_12000.ply"}) {
    EXPECT_TRUE(files->Contain(name)) << name;
  }
  for (const char* name : {"frame_0000.ply", "frame_12001.ply", "frame_00001.ply", "frame_001.ply",
                           "frame_0001.obj", "frame_+001.ply", "meta.json"}) {
    EXPECT_FALSE(files->Contain(name)) << name;
  }
  for (const char* json :
       {"", "[]", "{}", R"({"about": "mine"})", R"({"about": {"files": 3}})",
        R"({"about": {"files": {"prefix": 1, "extension": ".ply", "count": 2}}})"}) {
    EXPECT_FALSE(ExportedFilesIn(json).has_value()) << json;
  }
}

TEST(ToMetaJson, SaysRateAndUnitsAndTimesOnlyWhereTheyAreNotWholeFrames) {
  const auto parse = [](const ExportMeta& meta) { return nlohmann::json::parse(ToMetaJson(meta)); };
  const double rate = 23.976;
  nlohmann::json json = parse({rate, {0, 1 / rate, 2 / rate}, "families/f", 3, {{0.25, -0.5}}});
  EXPECT_EQ(json["fps"], rate);
  EXPECT_FALSE(json.contains("frame_times"));
  EXPECT_FALSE(json.contains("up"));
  EXPECT_EQ(json["units"]["vertex_scale"], 1);
  EXPECT_EQ(json["units"]["velocity_scale_to_m_per_s"], 1);
  EXPECT_EQ(json["about"]["version"], 3);
  EXPECT_EQ(json["about"]["weights"], nlohmann::json({0.25, -0.5}));
  json = parse({24, {0.5, 0.5 + 1.5 / 24, 0.5 + 4.0 / 24}, "families/f", 1, {{0.5}, {1.0}}});
  EXPECT_EQ(json["frame_times"], nlohmann::json({0.0, 1.5, 4.0}));
  EXPECT_EQ(json["about"]["weights"], nlohmann::json::parse("[[0.5], [1.0]]"));
  EXPECT_EQ(parse({24, {0}, "families/f", 1, {}, Up::kMinusY})["up"], "-y");
}

}  // namespace
}  // namespace liquidblend::cli
