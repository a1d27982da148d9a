// The command itself, run against a server with canned answers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <atomic>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "tests/client/cli/served_command.h"
#include "tests/e2e/faults/fault_proxy.h"
#include "tests/e2e/process.h"

namespace liquidblend::cli {
namespace {

using nlohmann::json;
using testing::CommandResult;
using testing::FakeServer;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Command : public ServedCommand {};

TEST_F(Command, WithoutASubcommandOrWithAWrongFlagIsAUsageError) {
  EXPECT_EQ(Run({}).exit_code, 2);
  EXPECT_EQ(Run({"frame", "drops"}).exit_code, 2);
  EXPECT_EQ(Run({"list", "--no-such-flag"}).exit_code, 2);
  const CommandResult weights =
      Run({"frame", "drops", "--weights", "0.5,half", "--time", "0", "-o", dir_.File("f.ply")});
  EXPECT_EQ(weights.exit_code, 2);
  EXPECT_THAT(weights.err, HasSubstr("\"half\" is not a number"));
}

TEST_F(Command, AValueThatIsNoNameOfItsFlagIsRefusedWithTheNames) {
  const std::vector<std::string> import = {"import", "a", dir_.path(), "--up", "w"};
  const std::vector<std::string> registration = {"register",  "f",   "--source",        "a",
                                                 "--target",  "b",   "--time-blending", "cube",
                                                 "--require", "good"};
  const std::vector<std::string> grade = {"register", "f", "--source",  "a",
                                          "--target", "b", "--require", "fine"};
  const std::vector<std::string> sheets = {"register", "f", "--source",           "a",
                                           "--target", "b", "--keep-thin-sheets", "yes"};
  const std::vector<std::string> format = {"export", "f",   "--weights", "0.5",
                                           "-o",     "out", "--format",  "fbx"};
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {import, "--up: 'w' is not one of x, y, z, -x, -y, -z"},
      {registration, "--time-blending: 'cube' is not one of auto, linear, squares"},
      {grade, "--require: 'fine' is not one of good, doubtful"},
      {sheets, "--keep-thin-sheets: 'yes' is not one of on, off"},
      {format, "--format: 'fbx' is not one of ply, obj, stl, bobj"},
  };
  for (const auto& [arguments, message] : cases) {
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 2) << message;
    EXPECT_THAT(result.err, HasSubstr(message));
  }
}

TEST_F(Command, HelpTellsTheExitCodes) {
  const CommandResult help = Run({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("Exit status: 0 done; 1 failed; 2"));
}

TEST_F(Command, WithoutAServerIsItsOwnExitCodeWithAdvice) {
  std::string nobody;
  {
    const FakeServer gone;
    nobody = gone.target();
  }
  const CommandResult result =
      testing::RunLiquidblend({"--server", nobody, "--connect-timeout", "0.05", "list"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr(nobody));
  EXPECT_THAT(result.err, HasSubstr("--server HOST:PORT"));
}

TEST_F(Command, TheEnvironmentSaysHowLongToWaitForTheServer) {
  setenv("LIQUIDBLEND_CONNECT_TIMEOUT", "0.05", /*overwrite=*/1);
  const CommandResult result = testing::RunLiquidblend({"--server", "127.0.0.1:1", "list"});
  unsetenv("LIQUIDBLEND_CONNECT_TIMEOUT");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("within 50ms"));
}

// As a virtual machine that is paused, for longer than the command waits.
TEST_F(Command, TimeInWhichItIsStoppedIsNoTimeWithoutAServer) {
  std::atomic<pid_t> command_pid = 0;
  e2e::FaultProxy proxy(server_.port());
  const auto pause = [&] {
    while (command_pid == 0) absl::SleepFor(absl::Milliseconds(1));
    kill(command_pid, SIGSTOP);
    absl::SleepFor(absl::Seconds(3));
  };
  proxy.Once("PRI * HTTP/2.0", 1, pause, [&] { kill(command_pid, SIGCONT); });
  e2e::Process command("liquidblend", {"--server", absl::StrCat("127.0.0.1:", proxy.port()),
                                       "--connect-timeout", "2", "inspect", "families/drops"});
  command_pid = command.pid();
  EXPECT_EQ(command.Wait(), 0);
  EXPECT_TRUE(proxy.is_struck());
}

TEST_F(Command, AMissingTokenIsAskedForByTheFlag) {
  server_.FailNext("ListFamilies", 1, absl::UnauthenticatedError("a token is needed"));
  const CommandResult result = Run({"list"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("--token-file FILE or LIQUIDBLEND_TOKEN_FILE"));
  const std::string none = dir_.File("none.token");
  EXPECT_THAT(Run({"--token-file", none, "list"}).err,
              HasSubstr("none.token: cannot be read: No such file or directory"));
}

TEST_F(Command, WhatIsNotThereIsItsOwnExitCode) {
  EXPECT_EQ(Run({"inspect", "none"}).exit_code, 4);
  EXPECT_EQ(Run({"inspect", "families/none"}).exit_code, 4);
  EXPECT_EQ(Run({"inspect", dir_.File("none.ply")}).exit_code, 4);
  EXPECT_EQ(Run({"operations", "none"}).exit_code, 4);
  EXPECT_EQ(Run({"import", "x", dir_.File("none")}).exit_code, 4);
}

TEST_F(Command, DamageIsItsOwnExitCode) {
  server_.FailNext("GetFamily", 1, absl::DataLossError("families/drops: damaged"));
  const CommandResult result = Run({"inspect", "families/drops"});
  EXPECT_EQ(result.exit_code, 7);
  EXPECT_THAT(result.err, HasSubstr("families/drops: damaged"));
}

TEST_F(Command, AFailedOperationIsAFailureAndACancelledOneCancelled) {
  const CommandResult failed =
      Run({"register", "bad", "--source", "drops-a", "--target", "drops-b", "--wait"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.err, HasSubstr("frame 12: edge 5-9 has one triangle"));
  EXPECT_EQ(Run({"operations", "cancelled-1", "--wait"}).exit_code, 5);
}

TEST_F(Command, ImportUploadsWaitsAndSaysWhatWasCleaned) {
  dir_.Write("f_0001.ply", "frame one");
  dir_.Write("f_0002.ply", "frame two");
  const CommandResult result = Run({"import", "drops-a", dir_.path(), "--fps", "30"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("animations/drops-a: ready"));
  EXPECT_THAT(result.out, HasSubstr("note: removed 3 zero-area triangles in frame 7"));
  EXPECT_THAT(result.err, HasSubstr("reading frames"));
  ASSERT_EQ(server_.Uploads().size(), 1u);
  EXPECT_EQ(server_.Uploads()[0].files.at("f_0002.ply"), "frame two");
  EXPECT_EQ(server_.Uploads()[0].frames_per_second, 30);
}

TEST_F(Command, ImportCanReturnAtOnceWithTheOperation) {
  dir_.Write("f_0001.ply", "frame");
  const CommandResult result = Run({"--json", "import", "drops-a", dir_.path(), "--no-wait"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out)["name"], "operations/import-1");
  EXPECT_EQ(server_.NumCalls("WatchOperation"), 0);
}

TEST_F(Command, RegisterShowsProgressOnStandardErrorAndTheFamilyOnStandardOutput) {
  const std::string correspondences = dir_.Write("c.json", R"({"correspondences": [[
      {"source": {"position": [1, 2, 3], "time_s": 0.5},
       "target": {"position": [1, 2, 3], "time_s": 0.75}}]]})");
  const CommandResult result = Run({"register",
                                    "drops",
                                    "--source",
                                    "drops-a",
                                    "--target",
                                    "drops-b",
                                    "--wait",
                                    "--iterations",
                                    "9",
                                    "--seed",
                                    "3",
                                    "--correspondences",
                                    correspondences,
                                    "--thin-sheets-from",
                                    "0.5",
                                    "--connectivity",
                                    "rebuilt",
                                    "--spacing",
                                    "0.75",
                                    "--droplet-vertices",
                                    "0",
                                    "--sheet-thickness",
                                    "2",
                                    "--levels",
                                    "1",
                                    "--keep-thin-sheets",
                                    "off"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("registration of target 1, iteration 7/16, fit 0.5"));
  EXPECT_THAT(result.err, HasSubstr("inliers 90 %, 1:05 left"));
  EXPECT_THAT(result.err, Not(HasSubstr("\r"))) << "plain lines without a terminal";
  EXPECT_THAT(result.out, HasSubstr("families/drops: version 3"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("max_iterations: 9"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("time_s: 0.75"));
  for (const char* part : {"thin_sheets_from: 0.5", "connectivity: REBUILT", "spacing_edges: 0.75",
                           "droplet_vertices: 0", "sheet_thickness_edges: 2", "coarser_levels: 1",
                           "keep_thin_sheets: false"}) {
    EXPECT_THAT(server_.LastRequest(), HasSubstr(part));
  }
  EXPECT_EQ(Run({"register", "drops", "--source", "drops-a", "--target", "drops-b",
                 "--connectivity", "perhaps"})
                .exit_code,
            2);
}

TEST_F(Command, RefineNeedsNoAnimationsAndTellsWhatBecameOfCorrespondences) {
  const CommandResult result = Run({"register", "drops", "--refine", "--wait"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(server_.LastRequest(), HasSubstr("refine: true"));
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("source")));
  EXPECT_THAT(result.out, HasSubstr("0: soft trajectory at (0, 0, 0) m, 0.5 s: overruled, residual "
                                    "0.25 m, 1.500 frames, 4 nodes"));
  const CommandResult inspected = Run({"--json", "inspect", "families/drops"});
  const json report = json::parse(inspected.out)["reports"][0]["correspondences"][0];
  EXPECT_EQ(report["correspondence"]["kind"], "TRAJECTORY");
  EXPECT_EQ(report["outcome"], "OVERRULED");
  EXPECT_EQ(report["residualFrames"], 1.5);
  EXPECT_EQ(report["correspondence"]["source"]["timeS"], 0.5);
  EXPECT_THAT(result.out, HasSubstr("1 nodes, automatic (0.75)\n"));
  EXPECT_FALSE(report.contains("automatic"));
  const CommandResult bare = Run({"register", "drops"});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_THAT(bare.err, HasSubstr("required without --refine"));
}

TEST_F(Command, InspectWritesCorrespondencesThatRegisterReadsAgain) {
  const std::string path = dir_.File("correspondences.json");
  EXPECT_EQ(Run({"inspect", "drops", "--correspondences-json", path}).exit_code, 0);
  EXPECT_EQ(Run({"register", "drops", "--refine", "--correspondences", path,
                 "--automatic-correspondences", "off"})
                .exit_code,
            0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("z: 0.1"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("automatic_correspondences: false"));
  EXPECT_EQ(Run({"register", "drops", "--refine", "--automatic-correspondences", "some"}).exit_code,
            2);
  const CommandResult refused =
      Run({"inspect", "animations/drops-a", "--correspondences-json", path});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("animations/drops-a is not a family"));
}

TEST_F(Command, RegisterWithoutWaitSaysHowToWatchUnlessQuiet) {
  const std::vector<std::string> arguments = {"register", "drops",    "--source",
                                              "drops-a",  "--target", "drops-b"};
  const CommandResult result = Run(arguments);
  EXPECT_EQ(result.out, "operations/register-1\n");
  EXPECT_THAT(result.err, HasSubstr("liquidblend operations operations/register-1 --wait"));
  std::vector<std::string> quiet = arguments;
  quiet.push_back("--quiet");
  EXPECT_THAT(Run(quiet).err, IsEmpty());
}

TEST_F(Command, CtrlCWhileWaitingCancelsNothingAndSaysHowToGoOn) {
  const CommandResult result = testing::InterruptLiquidblend(
      {"--server", server_.target(), "operations", "endless-1", "--wait"}, "iteration 7");
  EXPECT_EQ(result.exit_code, 130);
  EXPECT_THAT(result.err, HasSubstr("endless-1 goes on."));
  EXPECT_THAT(result.err, HasSubstr("liquidblend cancel endless-1"));
  EXPECT_EQ(server_.NumCalls("CancelOperation"), 0);
}

TEST_F(Command, FrameWritesEveryFormatAndTakesNegativeWeights) {
  for (const char* name : {"f.drc", "f.ply", "f.obj", "f.bobj.gz"}) {
    const CommandResult result = Run({"frame", "drops", "--weights", "-0.25", "--time", "0.5",
                                      "--bits", "18", "-o", dir_.File(name)});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto mesh = ReadMeshFile(dir_.File(name));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    const MeshStats stats = ComputeMeshStats(*mesh);
    EXPECT_TRUE(stats.closed()) << name;
    EXPECT_NEAR(stats.bounds.max.x, 0.5 + 0.75, 1e-4) << name;
  }
  EXPECT_EQ(Run({"frame", "drops", "-w", "0", "-t", "0", "-o", dir_.File("f.fbx")}).exit_code, 2);
  const CommandResult late =
      Run({"frame", "drops", "-w", "0", "-t", "99", "-o", dir_.File("late.ply")});
  EXPECT_EQ(late.exit_code, 2);
  EXPECT_THAT(late.err, HasSubstr("[0, 1]"));
}

TEST_F(Command, FrameAsksForTheSurfaceThatItsFlagsDescribe) {
  const std::vector<std::string> frame = {"frame", "drops", "-w", "0", "-t", "0", "-o"};
  const auto run = [&](const std::string& file, const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = frame;
    arguments.push_back(dir_.File(file));
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return Run(arguments);
  };
  ASSERT_EQ(run("f.ply", {}).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("surface")));
  ASSERT_EQ(run("f.ply", {"--lod", "2", "--smooth", "3", "--laplacian", "--smooth-strength", "0.25",
                          "--smooth-time", "0.75", "--normals", "--velocities"})
                .exit_code,
            0);
  for (const char* field : {"level_of_detail: 2", "smoothing_passes: 3", "smoothing: LAPLACIAN",
                            "smoothing_strength: 0.25", "temporal_smoothing: 0.75",
                            "attributes: NORMALS", "attributes: VELOCITIES"}) {
    EXPECT_THAT(server_.LastRequest(), HasSubstr(field));
  }
  const CommandResult no_place = run("f.obj", {"--velocities"});
  EXPECT_EQ(no_place.exit_code, 2);
  EXPECT_THAT(no_place.err, HasSubstr("--velocities: .obj files do not hold them"));
  EXPECT_EQ(run("f.ply", {"--smooth", "33"}).exit_code, 2);
}

TEST_F(Command, FramesAreEncodedAsTheFlagsSay) {
  const std::vector<std::string> frame = {"frame", "drops", "-w", "0",
                                          "-t",    "0",     "-o", dir_.File("f.drc")};
  const auto run = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = frame;
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return Run(arguments).exit_code;
  };
  ASSERT_EQ(run({"--encoding", "smallest", "--bits", "11"}), 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("preset: SMALLEST"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("position_bits: 11"));
  ASSERT_EQ(run({"--encoding", "balanced"}), 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("preset: BALANCED"));
  ASSERT_EQ(run({}), 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("preset: FASTEST"));
  EXPECT_EQ(run({"--encoding", "tiny"}), 2);
  ASSERT_EQ(run({"--step", "0.0002"}), 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("position_step_m: 0.0002"));
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("position_bits")));
  EXPECT_EQ(run({"--step", "0.0002", "--bits", "12"}), 2);
  EXPECT_EQ(run({"--step", "-1"}), 2);
}

TEST_F(Command, AStepTakesThePlaceOfTheDefaultBitsOfStreams) {
  ASSERT_EQ(
      Run({"export", "drops", "-w", "0", "-o", dir_.File("out"), "--step", "0.001"}).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("position_step_m: 0.001"));
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("position_bits")));
  ASSERT_EQ(Run({"stream", "drops", "--seconds", "0.1", "--step", "0.002"}).exit_code, 0);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("position_step_m: 0.002"));
}

TEST_F(Command, ExportWritesAFilePerFrameOfTheFormat) {
  const std::map<std::string, std::string> first = {
      {"ply", "frame_0001.ply"}, {"obj", "frame_0001.obj"}, {"bobj", "fluid_mesh_0001.bobj.gz"}};
  for (const auto& [format, name] : first) {
    const std::string directory = dir_.File("out/" + format);
    const CommandResult result = Run({"--json", "export", "drops", "--weights", "0.5", "-o",
                                      directory, "--format", format, "--fps", "4"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["num_files"], 5);
    EXPECT_EQ(report["first_file"], directory + "/" + name);
    const auto mesh = ReadMeshFile(directory + "/" + name);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_NEAR(ComputeMeshStats(*mesh).bounds.max.x, 1.5, 1e-5) << "world units";
  }
  EXPECT_TRUE(ReadMeshFile(dir_.File("out/ply/frame_0005.ply")).ok());
}

TEST_F(Command, ListInspectAndOperationsSpeakJson) {
  const json list = json::parse(Run({"list", "--json"}).out);
  EXPECT_EQ(list["animations"].size(), 2502u);
  EXPECT_EQ(list["families"][0]["targets"][0], "animations/drops-b");
  const json family = json::parse(Run({"inspect", "drops", "--json"}).out);
  EXPECT_EQ(family["name"], "families/drops");
  EXPECT_EQ(family["bounds"]["max"], json({{"x", 3.0}, {"y", 3.0}, {"z", 3.0}}));
  EXPECT_EQ(family["spaceTimeReports"][1]["animation"], "animations/drops-b");
  EXPECT_EQ(family["spaceTimeReports"][1]["connectivity"], "REBUILT");
  EXPECT_EQ(family["spaceTimeReports"][1]["numRigidPieces"], "42");
  EXPECT_EQ(family["spaceTimeReports"][1]["fidelity"]["maxVolumeError"], 0.0015);
  const json verdict = family["reports"][0]["verdict"];
  EXPECT_EQ(verdict["grade"], "DOUBTFUL");
  EXPECT_EQ(verdict["worst"]["position"], json({{"z", 1.25}}));
  EXPECT_EQ(verdict["worst"]["timeS"], 0.5);
  EXPECT_EQ(verdict["residualHistogram"], json::array({0.75}));
  EXPECT_EQ(verdict["volumeErrors"], json({0.01, -0.02}));
  EXPECT_EQ(verdict["coveredShare"], 0.93);
  const json animation = json::parse(Run({"inspect", "drops-a", "--json"}).out);
  EXPECT_EQ(animation["state"], "READY");
  const json operations = json::parse(Run({"operations", "--json"}).out);
  EXPECT_EQ(operations[1]["state"], "running");
  EXPECT_EQ(operations[2]["error"]["code"], "DATA_LOSS");
}

TEST_F(Command, OperationsTellWhenAndWhyAJobIsTriedAgain) {
  EXPECT_THAT(
      Run({"operations"}).out,
      HasSubstr("queued after attempt 2: no S3; next one at 22:13:20 UTC, handed back 3 times, "
                "priority 5"));
  const json retried = json::parse(Run({"operations", "--json"}).out)[3];
  EXPECT_EQ(retried["state"], "queued");
  EXPECT_EQ(retried["progress"]["attempt"], 2);
  EXPECT_EQ(retried["progress"]["priority"], 5);
  EXPECT_EQ(retried["progress"]["memoryBytes"], 7);
  EXPECT_EQ(retried["progress"]["handedBack"], 3);
  EXPECT_EQ(retried["progress"]["waitingFor"], "");
  EXPECT_EQ(retried["progress"]["nextAttemptTime"], "2023-11-14T22:13:20Z");
  EXPECT_EQ(retried["progress"]["lastFailure"]["code"], "UNAVAILABLE");
}

TEST_F(Command, AFailedRegistrationIsToldWhereItsFamilyIs) {
  const std::string failed = "failed at 2024-03-01T00:00:00Z: the frame rates differ";
  EXPECT_THAT(Run({"list"}).out, HasSubstr(failed));
  const CommandResult inspected = Run({"inspect", "empty"});
  EXPECT_EQ(inspected.exit_code, 0);
  EXPECT_EQ(inspected.out, "families/empty: no version; its registration " + failed +
                               "\n  operations/register-0\n");
  const json told = json::parse(Run({"inspect", "empty", "--json"}).out)["failedRegistration"];
  EXPECT_EQ(told["operation"], "operations/register-0");
  EXPECT_EQ(told["error"]["code"], 3);
  EXPECT_EQ(told["endTime"], "2024-03-01T00:00:00Z");
}

TEST_F(Command, AnOperationThatIsDoneTellsWhenWhoAndWhatCameOfIt) {
  const std::string course = ", began at 2024-03-01T00:00:00Z, took 90.0 s, worker mill:7";
  EXPECT_THAT(Run({"operations", "register-1", "--wait"}).out,
              HasSubstr(course + ", version 3, verdict doubtful\n"));
  const CommandResult failed = Run({"operations", "failed-1", "--wait"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.out, HasSubstr(course + ": frame 12: edge 5-9 has one triangle"));
  const json done = json::parse(Run({"operations", "register-1", "--wait", "--json"}).out);
  EXPECT_EQ(done["version"], 3);
  EXPECT_EQ(done["verdict"], "doubtful");
  EXPECT_EQ(done["progress"]["startTime"], "2024-03-01T00:00:00Z");
  EXPECT_EQ(done["progress"]["endTime"], "2024-03-01T00:01:30Z");
  EXPECT_EQ(done["progress"]["worker"], "mill:7");
}

TEST_F(Command, PrioritiesOutOfRangeAreRefusedHere) {
  for (const char* priority : {"-101", "101", "high"}) {
    EXPECT_EQ(
        Run({"register", "f", "--source", "a", "--target", "b", "--priority", priority}).exit_code,
        2);
  }
}

TEST_F(Command, InspectTellsHowWellAFamilyShowsItsAnimations) {
  const std::string text = Run({"inspect", "drops"}).out;
  EXPECT_THAT(text, HasSubstr("animations/drops-a: rebuilt on a grid of 0.018 m (0.9 mean edges), "
                              "4321 vertices, 4000 hexahedra, 60 wedges, 3 droplets in 42 pieces, "
                              "12.5 % thin\n"
                              "    16 frames: distance 0.0250 mean edges, 0.500 at most; volume "
                              "within 0.150 %; 48 components of 47, 1 apart at most\n"));
}

TEST_F(Command, InspectTellsTheVerdict) {
  const std::string out = Run({"inspect", "drops"}).out;
  EXPECT_THAT(
      out,
      HasSubstr(
          "doubtful: 7 % of the target is not covered by the source; worst near "
          "(0, 0, 1.25) m at 0.5 s\n"
          "    compatible share 99 %, component error 0.5, covered share 93 %, fit energy 0, "
          "inverted share 0.1 %, part fall error 0.06, part shift 0.125, part volume error 0.02, "
          "relief loss 0.25, smoothness energy 0, stretch 0.11, unmatched share 20 %\n"));
  EXPECT_THAT(out, Not(HasSubstr("volume errors")));  // a list; --json has it
}

TEST_F(Command, InspectTellsWhichPairingsWereTried) {
  EXPECT_THAT(Run({"inspect", "drops"}).out,
              HasSubstr("    tried the pairs of features of least cost: cost 0.75, kept\n"
                        "    tried no pairs of features: cost 3.5\n"));
  EXPECT_THAT(
      Run({"inspect", "drops", "--json"}).out,
      AllOf(HasSubstr("\"pairing\": \"no pairs of features\""), HasSubstr("\"cost\": 3.5")));
}

TEST_F(Command, InspectDescribesAMeshFile) {
  const std::string path = dir_.File("m.ply");
  ASSERT_TRUE(WriteMeshFile(testing::MakeOctahedron(0.0, 0.0), path).ok());
  EXPECT_THAT(Run({"inspect", path}).out, HasSubstr("closed and oriented; volume 1.33333 m^3"));
  const json stats = json::parse(Run({"inspect", path, "--json"}).out);
  EXPECT_EQ(stats["num_components"], 1);
  EXPECT_EQ(stats["closed"], true);
}

TEST_F(Command, InspectListsKeptVersionsAndRollbackGoesBackToOne) {
  EXPECT_THAT(Run({"inspect", "drops"}).out,
              HasSubstr("version 2 is kept: animations/drops-a -> animations/drops-c, of "
                        "2024-03-01T00:00:00Z"));
  const json kept = json::parse(Run({"--json", "inspect", "drops"}).out)["keptVersions"];
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0]["version"], "2");
  const CommandResult back = Run({"rollback", "drops", "2"});
  EXPECT_EQ(back.exit_code, 0) << back.err;
  EXPECT_THAT(back.out, HasSubstr("families/drops: version 4, which is version 2 again"));
  EXPECT_EQ(Run({"rollback", "drops", "1"}).exit_code, 4);
  EXPECT_EQ(Run({"rollback", "drops", "0"}).exit_code, 2);
  EXPECT_EQ(Run({"rollback", "drops"}).exit_code, 2);
}

TEST_F(Command, DeleteFindsTheCollectionAndCancelAnswers) {
  EXPECT_EQ(Run({"delete", "drops-a"}).exit_code, 0);
  EXPECT_EQ(Run({"delete", "families/drops"}).exit_code, 0);
  EXPECT_THAT(server_.Deleted(), ::testing::ElementsAre("animations/drops-a", "families/drops"));
  EXPECT_EQ(Run({"delete", "none"}).exit_code, 4);
  EXPECT_EQ(Run({"delete", "operations/register-1"}).exit_code, 2);
  EXPECT_THAT(Run({"cancel", "register-1"}).out, HasSubstr("is being cancelled"));
}

TEST_F(Command, StreamReportsPaceAndReaction) {
  const CommandResult result =
      Run({"stream", "drops", "--seconds", "3", "--fps", "100", "--sweep", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_GT(report["num_frames"], 10);
  EXPECT_GT(report["num_bytes"], 1000);
  EXPECT_GT(report["interval_ms"]["p99"], 0.0);
  EXPECT_GT(report["reaction_ms"]["p50"], 0.0);
  EXPECT_EQ(report["frames_by_level"].size(), 1u);
}

TEST_F(Command, AnAdaptingStreamTellsTheLevelsThatCame) {
  const CommandResult result = Run({"stream", "drops", "--seconds", "0.1", "--adapt"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("frames by level of detail: 0, "));  // all at 1: fake_server.cc
  EXPECT_THAT(server_.LastRequest(), HasSubstr("adapt_level_of_detail: true"));
}

TEST_F(Command, WaitsWhenTheServerSaysSoAndNotBeyondItsPatience) {
  const absl::Status busy =
      testing::WithRetryDelay(absl::ResourceExhaustedError("busy"), absl::Milliseconds(150));
  server_.FailNext("GetFamily", 1, busy);
  EXPECT_EQ(Run({"inspect", "drops"}).exit_code, 0);
  server_.FailNext("GetFamily", 1, busy);
  const CommandResult impatient = Run({"--patience", "0", "inspect", "drops"});
  EXPECT_NE(impatient.exit_code, 0);
  EXPECT_THAT(impatient.err, HasSubstr("busy; try again in 150ms"));
}

TEST_F(Command, RenderMakesASheetOfWeightsByTimes) {
  const CommandResult result =
      Run({"render", "drops", "-w", "0", "-w", "-0.25", "--times", "0,0.5,1", "--size", "64x48",
           "--samples", "1", "--json", "-o", dir_.File("sheet.png")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_GE(report["width"], 3 * 64);
  EXPECT_GE(report["height"], 2 * 48);
  EXPECT_EQ(testing::ReadBytes(dir_.File("sheet.png")).substr(1, 3), "PNG");
  EXPECT_EQ(server_.NumCalls("GetFrame"), 6);
}

TEST_F(Command, RenderDrawsLocalFilesWithoutAServer) {
  const std::string path = dir_.File("m.obj");
  ASSERT_TRUE(WriteMeshFile(testing::MakeOctahedron(0.0, 0.0), path).ok());
  const std::string sheet = dir_.File("sheet.png");
  const std::vector<std::string> flags = {"render", "--size", "48x48",   "--samples", "1",
                                          "-o",     sheet,    "--files", path,        path};
  const CommandResult result = testing::RunLiquidblend(flags);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(testing::ReadBytes(sheet), Not(IsEmpty()));
  EXPECT_EQ(testing::RunLiquidblend({"render", "-o", sheet}).exit_code, 2);
  EXPECT_EQ(testing::RunLiquidblend({"render", "--files", path, "-o", "x.jpg"}).exit_code, 2);
  EXPECT_EQ(
      testing::RunLiquidblend({"render", "--files", path, "--size", "9", "-o", sheet}).exit_code,
      2);
}

}  // namespace
}  // namespace liquidblend::cli
