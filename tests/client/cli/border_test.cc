// Messages of `liquidblend` about words, numbers and paths that are wrong: the culprit and the next
// step. And `convert`, which needs no server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/files/mesh_file.h"
#include "tests/client/cli/served_command.h"

namespace liquidblend::cli {
namespace {

using testing::CommandResult;
using ::testing::HasSubstr;
using ::testing::Not;

class Border : public ServedCommand {};

TEST_F(Border, AMistypedCommandIsNamedWithTheNearestOne) {
  CommandResult result = Run({"exprot", "drops", "-w", "0.5", "-o", dir_.File("out")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err,
            "liquidblend: there is no command 'exprot'; did you mean 'export'?\n"
            "`liquidblend --help` lists all commands.\n");
  result = Run({"upload"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("there is no command 'upload'\n"));
}

TEST_F(Border, ANumberWithAUnitIsRefusedAsSuch) {
  const CommandResult patience = Run({"list", "--patience", "10s"});
  EXPECT_EQ(patience.exit_code, 2);
  EXPECT_THAT(patience.err, HasSubstr("--patience: must be 0 or more, without a unit, got 10s"));
  EXPECT_THAT(Run({"list", "--patience", "-1"}).err, HasSubstr("must be 0 or more, got -1"));
}

TEST_F(Border, ANumberOutOfRangeIsNamedInOneShortSentence) {
  const std::vector<std::string> registration = {"register", "f",        "--source",
                                                 "drops-a",  "--target", "drops-b"};
  const std::pair<std::string, std::string> flags[] = {
      {"--iterations", "in [1, 200]"}, {"--node-spacing", "in [1, 100]"}, {"--spacing", "above 0"}};
  for (const auto& [flag, range] : flags) {
    for (const char* value : {"0", "-1", "nan", "much"}) {
      std::vector<std::string> arguments = registration;
      arguments.insert(arguments.end(), {flag, value});
      const CommandResult result = Run(arguments);
      EXPECT_EQ(result.exit_code, 2) << flag;
      EXPECT_THAT(result.err, HasSubstr(flag + ": must be " + range + ", got " + value));
      EXPECT_LT(result.err.size(), 120u) << result.err;
    }
  }
  std::vector<std::string> levels = registration;
  levels.insert(levels.end(), {"--levels", "-1"});
  EXPECT_THAT(Run(levels).err, HasSubstr("--levels: must be 0 or more, got -1"));
  for (const char* version : {"-1", "first"}) {
    const CommandResult result = Run(
        {"frame", "drops", "-w", "0.5", "-t", "0", "-o", dir_.File("f.ply"), "--version", version});
    EXPECT_EQ(result.exit_code, 2) << version;
    EXPECT_THAT(result.err, HasSubstr(std::string("--version: must be 0 or more, got ") + version));
    EXPECT_LT(result.err.size(), 120u) << result.err;
  }
  for (const char* version : {"0", "first"}) {
    const CommandResult result = Run({"rollback", "drops", version});
    EXPECT_EQ(result.exit_code, 2) << version;
    EXPECT_THAT(result.err, HasSubstr(std::string("VERSION: must be above 0, got ") + version));
    EXPECT_LT(result.err.size(), 120u) << result.err;
  }
}

TEST_F(Border, ALocalFolderThatIsNotThereIsNamedBeforeAServerIsAsked) {
  const std::string none = dir_.File("none");
  const CommandResult result =
      testing::RunLiquidblend({"--server", "127.0.0.1:1", "import", "a", none});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr(none + ": No such file or directory (a folder on this mach"));
  EXPECT_THAT(result.err, Not(HasSubstr("127.0.0.1:1")));
}

TEST_F(Border, APatternGoesAlongWithAnImportFromTheServersDisk) {
  const CommandResult result =
      Run({"import", "drops-a", "--from-server", "x/y", "--pattern", "f.*"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(server_.LastRequest(), HasSubstr("pattern: \"f.*\""));
}

TEST_F(Border, AnOutputThatCannotBeIsNamedBeforeAServerIsAsked) {
  const std::vector<std::string> frame = {"--server", "127.0.0.1:1", "frame", "drops", "-w",
                                          "0.5",      "-t",          "0",     "-o"};
  const auto write = [&](const std::string& path) {
    std::vector<std::string> arguments = frame;
    arguments.push_back(path);
    return testing::RunLiquidblend(arguments);
  };
  const std::string missing = dir_.File("missing");
  CommandResult result = write(missing + "/f.ply");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "liquidblend: " + missing +
                            "/f.ply: cannot be written: there is no folder " + missing +
                            "; make it first\n");
  std::filesystem::create_directory(dir_.File("folder.ply"));
  EXPECT_THAT(write(dir_.File("folder.ply")).err, HasSubstr("folder.ply is a folder; give the "));
  const std::string file = dir_.Write("file", "x");
  result = Run({"export", "drops", "-w", "0.5", "-o", file + "/out"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("file/out: "));
  EXPECT_THAT(result.err, HasSubstr("choose a folder that you may write to"));
}

TEST_F(Border, AFrameIsOfTheNewestVersionOrNone) {
  const std::vector<std::string> frame = {"--patience", "0",  "frame", "drops", "-w",
                                          "0.5",        "-t", "0",     "-o",    dir_.File("f.ply")};
  ASSERT_EQ(Run(frame).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("min_version: 3"));
  // The server could still serve what it has in memory, whatever was published since.
  std::filesystem::remove(dir_.File("f.ply"));
  server_.FailNext("GetFamily", 100, absl::UnavailableError("the catalog is away"));
  const CommandResult result = Run(frame);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("the catalog is away"));
  EXPECT_FALSE(std::filesystem::exists(dir_.File("f.ply")));
}

TEST_F(Border, CapitalsInExtensionsAreTaken) {
  const std::string path = dir_.File("F.OBJ");
  EXPECT_EQ(Run({"frame", "drops", "-w", "0.5", "-t", "0", "-o", path}).exit_code, 0);
  EXPECT_TRUE(ReadMeshFile(path).ok());
  EXPECT_EQ(Run({"inspect", path}).exit_code, 0);
  std::filesystem::create_directory(dir_.File("in"));
  for (const char* name : {"in/F_0001.OBJ", "in/F_0002.OBJ"}) {
    dir_.Write(name, testing::ReadBytes(path));
  }
  EXPECT_EQ(Run({"import", "drops-a", dir_.File("in")}).exit_code, 0);
  EXPECT_EQ(server_.Uploads()[0].files.size(), 2u);
}

TEST_F(Border, ConvertWritesTheMeshInEachFormatWithoutAServer) {
  const std::string draco = dir_.File("f.drc");
  ASSERT_EQ(Run({"frame", "drops", "-w", "0.5", "-t", "0", "-o", draco}).exit_code, 0);
  const auto before = ReadMeshFile(draco);
  ASSERT_TRUE(before.ok()) << before.status();
  for (const char* name : {"f.ply", "f.obj", "f.bobj.gz", "again.PLY"}) {
    const CommandResult result =
        testing::RunLiquidblend({"--server", "127.0.0.1:1", "convert", draco, dir_.File(name)});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto after = ReadMeshFile(dir_.File(name));
    ASSERT_TRUE(after.ok()) << after.status();
    EXPECT_EQ(after->positions, before->positions) << name;
    EXPECT_EQ(after->triangles, before->triangles) << name;
  }
  EXPECT_THAT(Run({"convert", draco, dir_.File("g.drc")}).err,
              HasSubstr("g.drc: must end in .ply, .obj, .bobj.gz or .stl"));
  EXPECT_EQ(Run({"convert", dir_.File("none.drc"), dir_.File("g.ply")}).exit_code, 4);
}

TEST_F(Border, ConvertKeepsNormalsAndVelocitiesOrSaysThatItDoesNot) {
  Mesh mesh = testing::MakeOctahedron(0.5, 0.0);
  mesh.normals.assign(mesh.positions.size(), 0.25f);
  mesh.velocities.assign(mesh.positions.size(), 3.0f);
  const std::string ply = dir_.Write("a.ply", ToPly(mesh));
  const auto convert = [&](const std::string& from, const std::string& to) {
    const CommandResult result = testing::RunLiquidblend({"convert", from, dir_.File(to)});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  EXPECT_EQ(convert(ply, "b.ply"), "");
  const auto read = ReadMeshFile(dir_.File("b.ply"));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->normals, mesh.normals);
  EXPECT_EQ(read->velocities, mesh.velocities);
  EXPECT_THAT(convert(ply, "b.obj"),
              HasSubstr("b.obj: without normals and velocities, which .obj"));
  EXPECT_THAT(convert(ply, "b.bobj.gz"),
              HasSubstr("b.bobj.gz: without velocities, which .bobj.gz"));
  EXPECT_EQ(convert(dir_.File("b.bobj.gz"), "c.ply"), "");
  EXPECT_EQ(ReadMeshFile(dir_.File("c.ply"))->normals, mesh.normals);
  const std::string obj = dir_.Write("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1 2 3\n");
  EXPECT_THAT(convert(obj, "d.ply"), HasSubstr("d.ply: without normals of " + obj));
}

// Pictures of a mesh that is longer along y than along z differ with the direction that is up.
TEST_F(Border, RenderTakesUpFromTheMetaBesideTheFilesOrSaysWhatItAssumes) {
  Mesh mesh = testing::MakeOctahedron(0.5, 0.0);
  for (size_t k = 1; k < mesh.positions.size(); k += 3) mesh.positions[k] *= 3.0f;
  const std::string file = dir_.Write("frame_0001.ply", ToPly(mesh));
  const auto render = [&](const std::string& name, std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"render", "--files", file, "-o", dir_.File(name), "--size",
                                 "40x30", "--samples", "1"});
    const CommandResult result = testing::RunLiquidblend(flags);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.err;
  };
  const std::string assumed = "Assumed that z is up in " + file;
  EXPECT_THAT(render("z.png", {}), HasSubstr(assumed));
  EXPECT_THAT(render("y.png", {"--up", "y"}), Not(HasSubstr("Assumed")));
  dir_.Write("meta.json", R"({"up": "y"})");
  EXPECT_THAT(render("meta.png", {}), Not(HasSubstr("Assumed")));
  EXPECT_EQ(testing::ReadBytes(dir_.File("meta.png")), testing::ReadBytes(dir_.File("y.png")));
  EXPECT_NE(testing::ReadBytes(dir_.File("meta.png")), testing::ReadBytes(dir_.File("z.png")));
  for (const char* silent : {"{}", R"({"up": 3})", "no JSON"}) {
    dir_.Write("meta.json", silent);
    EXPECT_THAT(render("none.png", {}), HasSubstr(assumed)) << silent;
  }
}

}  // namespace
}  // namespace liquidblend::cli
