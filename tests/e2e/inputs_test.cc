// Inputs that are not one clean frame per number, through the real programs: frames that touch
// themselves, missing numbers, samples between frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "core/mesh/triangle_mesh.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/paths.h"
#include "tests/synthetic/implicit.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/voxels.h"
#include "tests/worker/ingest/formats/encode_files.h"

namespace liquidblend::e2e {
namespace {

namespace fs = std::filesystem;
using liquidblend::testing::CommandResult;
using liquidblend::testing::TempDir;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class InputsTest : public E2eTest {
 protected:
  InputsTest() {
    lease_ = "30s";  // no worker is lost here
    server_ = StartServer(/*num_workers=*/1);
  }

  CommandResult Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--server", Address(), "--quiet"});
    return liquidblend::testing::RunLiquidblend(arguments);
  }

  // What it says.
  std::string RunOrDie(const std::vector<std::string>& arguments) const {
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments[0] << ": " << result.err;
    return result.out;
  }

  // Two balls or drops may be too different for the verdict (6), and serve all the same.
  void Register(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "register");
    arguments.push_back("--wait");
    const CommandResult result = Run(arguments);
    EXPECT_THAT(result.exit_code, AnyOf(0, 6)) << result.err;
  }

  std::string MakeFolder(const std::string& name) const {
    fs::create_directory(folder_.File(name));
    return folder_.File(name);
  }

  // Writes the meshes as PLY files of these names into a new folder.
  std::string WriteFrames(const std::string& folder, const std::vector<std::string>& names,
                          const std::vector<mesh::TriangleMesh>& frames) const {
    MakeFolder(folder);
    for (size_t k = 0; k < frames.size(); ++k) {
      const ingest::Bytes bytes = ingest::Ply(frames[k], ingest::PlyKind::kLittleEndian);
      folder_.Write(folder + "/" + names[k],
                    {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    }
    return folder_.File(folder);
  }

  // Of an import whose client does not look at the names: INVALID_ARGUMENT with this message.
  std::string ErrorOfUpload(const std::string& id, const std::string& folder,
                            const std::vector<std::string>& names) {
    std::vector<NamedBytes> files;
    for (const std::string& name : names) {
      files.push_back({name, liquidblend::testing::ReadBytes(folder + "/" + name)});
    }
    Operation operation;
    EXPECT_TRUE(Upload(id, files, "request-" + id, operation).ok());
    operation = AwaitDone(operation.name());
    EXPECT_EQ(operation.error().code(), static_cast<int>(absl::StatusCode::kInvalidArgument));
    return operation.error().message();
  }

  cli::MeshStats Frame(const std::string& family, double weight, double time_s) const {
    const std::string path = folder_.File("frame.ply");
    RunOrDie({"frame", family, "-w", std::to_string(weight), "-t", std::to_string(time_s), "-o",
              path, "--bits", "20"});
    const absl::StatusOr<Mesh> mesh = cli::ReadMeshFile(path);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return mesh.ok() ? cli::ComputeMeshStats(*mesh) : cli::MeshStats();
  }

  // The edges of four triangles and more in all files of a folder.
  static int64_t NumNonManifoldEdges(const std::string& folder) {
    int64_t num_non_manifold = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.path().filename() == "meta.json") continue;
      const absl::StatusOr<Mesh> read = cli::ReadMeshFile(entry.path().string());
      EXPECT_TRUE(read.ok()) << read.status();
      if (!read.ok()) continue;
      mesh::TriangleMesh mesh;
      mesh.triangles.resize(3, static_cast<int64_t>(read->num_triangles()));
      std::copy(read->triangles.begin(), read->triangles.end(), mesh.triangles.data());
      num_non_manifold += mesh::CheckClosed(mesh).num_non_manifold_edges;
    }
    return num_non_manifold;
  }

  TempDir folder_;
  Process server_;
};

double CentreX(const cli::MeshStats& stats) {
  return (stats.bounds.min.x + stats.bounds.max.x) / 2;
}

std::vector<std::string> PlainNames(int count) {
  std::vector<std::string> names;
  for (int k = 1; k <= count; ++k) names.push_back("frame_000" + std::to_string(k) + ".ply");
  return names;
}

// Random cubes that drift along x; some appear and disappear in each frame.
std::vector<mesh::TriangleMesh> Cubes(int num_frames, float step) {
  constexpr int kNumChanges = 60;
  synthetic::Voxels voxels = synthetic::RandomVoxels(8, 0.5, 3);
  std::vector<mesh::TriangleMesh> frames;
  for (int k = 0; k < num_frames; ++k) {
    frames.push_back(synthetic::VoxelSurface(voxels));
    frames.back().vertices.row(0).array() += step * static_cast<float>(k);
    frames.back().velocities =
        Eigen::Vector3f(24 * step, 0, 0).replicate(1, frames.back().num_vertices());
    for (int i = 0; i < kNumChanges; ++i) {
      voxels.is_liquid[(37 * k + 11 * i) % voxels.is_liquid.size()].flip();
    }
  }
  return frames;
}

TEST_F(InputsTest, FramesThatTouchThemselvesGoAllTheWayAndExportsComeBack) {
  constexpr int kNumFrames = 4;
  const std::string a = WriteFrames("a", PlainNames(kNumFrames), Cubes(kNumFrames, 0.1f));
  const std::string b = WriteFrames("b", PlainNames(kNumFrames), Cubes(kNumFrames, 0.2f));
  EXPECT_GT(NumNonManifoldEdges(a), 0);
  EXPECT_THAT(RunOrDie({"import", "a", a}), HasSubstr("edges with four triangles or more"));
  RunOrDie({"import", "b", b});
  Register({"f", "--source", "a", "--target", "b", "--iterations", "2"});
  const std::string out = MakeFolder("out");
  RunOrDie({"export", "f", "-w", "0.5", "-o", out});
  const std::string imported = RunOrDie({"import", "out", out});
  EXPECT_THAT(imported, HasSubstr("4 frames"));
  EXPECT_EQ(absl::StrContains(imported, "edges with four triangles or more"),
            NumNonManifoldEdges(out) > 0);
}

// An export into a folder that holds an earlier one, in another format and of more frames.
TEST_F(InputsTest, AnExportReplacesAnEarlierOneOnlyIfAskedTo) {
  RunOrDie({"import", "a", WriteFrames("a", PlainNames(4), Cubes(4, 0.1f))});
  RunOrDie({"import", "b", WriteFrames("b", PlainNames(4), Cubes(4, 0.2f))});
  Register({"f", "--source", "a", "--target", "b", "--iterations", "1"});
  const std::string out = MakeFolder("out");
  const std::vector<std::string> again = {"export", "f", "-w", "0.25", "-o", out, "--fps", "12"};
  RunOrDie({"export", "f", "-w", "0.5", "-o", out, "--format", "bobj"});
  const auto before = liquidblend::testing::ListFolder(out);
  const std::string meta = liquidblend::testing::ReadBytes(out + "/meta.json");
  const CommandResult refused = Run(again);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("the folder is not empty, it holds fluid_mesh_0001.bobj.gz"));
  EXPECT_EQ(liquidblend::testing::ListFolder(out), before);
  EXPECT_EQ(liquidblend::testing::ReadBytes(out + "/meta.json"), meta);
  std::vector<std::string> overwrite = again;
  overwrite.push_back("--overwrite");
  RunOrDie(overwrite);
  EXPECT_THAT(liquidblend::testing::ListFolder(out),
              ElementsAre("frame_0001.ply", "frame_0002.ply", "meta.json"));
  const std::string imported = RunOrDie({"import", "out", out});
  EXPECT_THAT(imported, HasSubstr("2 frames from number 1 at 12 per second"));
  folder_.Write("out/frame_0009.ply", "mine");  // foreign: an overwriting export stops at it
  const CommandResult mixed = Run(overwrite);
  EXPECT_EQ(mixed.exit_code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("holds frame_0009.ply"));
  EXPECT_EQ(liquidblend::testing::ReadBytes(out + "/frame_0009.ply"), "mine");
}

TEST_F(InputsTest, AnExportedBlendOfTwoDropsCanBeImported) {
  const fs::path simulations = paths::Source("tests/data/two_drops");
  for (const std::string name : {"A", "B"}) {
    const std::string folder = MakeFolder(name);
    for (const std::string file :
         {"fluid_mesh_0047.bobj.gz", "lVelMesh_0047.uni", "fluid_mesh_0048.bobj.gz",
          "lVelMesh_0048.uni", "fluid_mesh_0049.bobj.gz", "lVelMesh_0049.uni", "meta.json"}) {
      fs::copy(simulations / name / file, folder);
    }
    RunOrDie({"import", name == "A" ? "a" : "b", folder});
  }
  Register({"f", "--source", "a", "--target", "b", "--iterations", "2"});
  for (const std::string format : {"ply", "bobj"}) {
    const std::string out = MakeFolder("out_" + format);
    RunOrDie({"export", "f", "-w", "0.5", "-o", out, "--format", format});
    EXPECT_THAT(RunOrDie({"import", "out-" + format, out}), HasSubstr("3 frames"));
  }
}

TEST_F(InputsTest, FramesOfTwoSequencesAreRefusedAndAPatternChooses) {
  const std::vector<std::string> names = {"foam.0003.ply", "liquid.0001.ply", "liquid.0002.ply"};
  const std::string folder = WriteFrames("mixed", names, Cubes(3, 0.1f));
  const std::string message = "frames of two sequences, foam.0003.ply and liquid.0001.ply";
  const CommandResult refused = Run({"import", "a", folder});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr(message));
  EXPECT_EQ(NumOperations(), 0);  // nothing was sent
  EXPECT_THAT(Run({"import", "a", folder, "--pattern", "liquid.####.ply"}).err,
              HasSubstr("none of its 3 frames, such as foam.0003.ply, is called 'liquid.####.ply' "
                        "(--pattern: * stands for any characters, ? for one)"));
  EXPECT_THAT(RunOrDie({"import", "a", folder, "--pattern", "liquid.*"}), HasSubstr("2 frames"));
  EXPECT_THAT(ErrorOfUpload("b", folder, names), HasSubstr(message));
}

TEST_F(InputsTest, NumberedRunsInOneFolderAreRefusedUnlessTheTimesAreGiven) {
  const std::vector<std::string> names = {"run1.01.ply", "run1.02.ply", "run2.01.ply",
                                          "run2.02.ply"};
  const std::string folder = WriteFrames("runs", names, Cubes(4, 0.1f));
  const std::string message = "frames of two sequences, run1.01.ply and run2.01.ply";
  const CommandResult refused = Run({"import", "a", folder});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr(message));
  EXPECT_EQ(NumOperations(), 0);  // nothing was sent
  EXPECT_THAT(RunOrDie({"import", "a", folder, "--pattern", "run1.*"}), HasSubstr("2 frames"));
  EXPECT_THAT(RunOrDie({"import", "b", folder, "--frame-times", "0,1,2,3"}), HasSubstr("4 frames"));
  EXPECT_THAT(ErrorOfUpload("c", folder, names), HasSubstr(message));
}

TEST_F(InputsTest, WhatIsAssumedIsNotedAndWhatIsWrongInMetaJsonIsRefused) {
  const std::string folder = WriteFrames("plain", PlainNames(2), Cubes(2, 0.1f));
  EXPECT_THAT(RunOrDie({"import", "a", folder}),
              HasSubstr("Assumed 24 frames per second, positions in metres and velocities in the "
                        "unit of positions per second, as neither options (--fps, --vertex-scale, "
                        "--velocity-scale) nor a meta.json say so."));
  const auto refused = [&](const std::string& meta) {
    folder_.Write("plain/meta.json", meta);
    const CommandResult result = Run({"import", "b", folder});
    EXPECT_NE(result.exit_code, 0) << meta;
    return result.err;
  };
  EXPECT_THAT(refused(R"({"frame_rate": 30})"),
              HasSubstr("meta.json: key \"frame_rate\" is not known"));
  EXPECT_THAT(refused(R"({"units": {"vertices": "cm"}})"),
              HasSubstr("meta.json: units.vertices is \"cm\", not metres"));
}

TEST_F(InputsTest, NumbersThatAreTakenAsTimesAreNoted) {
  const std::string folder =
      WriteFrames("halves", {"a_1.0.ply", "a_1.5.ply", "a_2.0.ply", "a_2.5.ply"}, Cubes(4, 0.1f));
  EXPECT_THAT(RunOrDie({"import", "a", folder}),
              HasSubstr("Took numbers as times in frames, from 1 (a_1.0.ply) to 2.5 (a_2.5.ply)."));
}

TEST_F(InputsTest, AnOpenMeshIsRefusedWithThePlaceOfItsHole) {
  mesh::TriangleMesh ball = synthetic::Icosphere({0, 0, 0}, 0.5, 2);
  ball.triangles.conservativeResize(3, ball.num_triangles() - 1);
  const std::string folder = WriteFrames("open", PlainNames(1), {ball});
  const CommandResult refused = Run({"import", "a", folder});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.err, HasSubstr("frame 1, frame_0001.ply: edge ("));
  EXPECT_THAT(refused.err, HasSubstr("1 hole with 3 open edges in all; fill them before"));
}

constexpr double kSpeed = 3.0;   // metres per second, along x
constexpr double kRadius = 0.5;  // metres

// A moving ball at these frame numbers, from 1 on, each with triangles of its own.
std::vector<mesh::TriangleMesh> RebuiltBall(const std::vector<double>& numbers) {
  std::vector<mesh::TriangleMesh> frames;
  for (const double number : numbers) {
    const Eigen::Vector3d centre(kSpeed * (number - 1) / 24, 0, 0);
    const auto distance = [&](const Eigen::Vector3d& p) { return (p - centre).norm() - kRadius; };
    const double spacing = 0.1 + 0.01 * static_cast<double>(frames.size() % 4);
    frames.push_back(
        synthetic::Polygonize(distance, {{-0.7f, -0.7f, -0.7f}, {1.4f, 0.7f, 0.7f}, spacing}));
    frames.back().velocities =
        Eigen::Vector3f(kSpeed, 0, 0).replicate(1, frames.back().num_vertices());
  }
  return frames;
}

// The same with the same triangles in all frames.
std::vector<mesh::TriangleMesh> TrackedBall(const std::vector<double>& numbers) {
  std::vector<mesh::TriangleMesh> frames;
  for (const double number : numbers) {
    frames.push_back(synthetic::Icosphere({0, 0, 0}, kRadius, 3));
    frames.back().vertices.row(0).array() += static_cast<float>(kSpeed * (number - 1) / 24);
    frames.back().velocities =
        Eigen::Vector3f(kSpeed, 0, 0).replicate(1, frames.back().num_vertices());
  }
  return frames;
}

struct RoundTrip {
  std::string name;
  std::string format;
  std::vector<std::string> flags;  // of the export
  double frames_per_second;
};

class RoundTripTest : public InputsTest, public ::testing::WithParamInterface<RoundTrip> {
 protected:
  nlohmann::json Inspect(const std::string& name) const {
    return nlohmann::json::parse(RunOrDie({"inspect", name, "--json"}));
  }

  // Imports the folder as NAME-a and NAME-b, and registers these as NAME.
  void ImportAndRegister(const std::string& name, const std::string& folder,
                         const std::vector<std::string>& flags = {}) const {
    for (const char* id : {"-a", "-b"}) {
      std::vector<std::string> import = {"import", name + id, folder};
      import.insert(import.end(), flags.begin(), flags.end());
      EXPECT_THAT(RunOrDie(import), Not(HasSubstr("Assumed")));
    }
    Register({name, "--source", name + "-a", "--target", name + "-b", "--iterations", "1",
              "--levels", "0"});
  }

  bool HasFlag(const std::string& flag) const {
    return std::count(GetParam().flags.begin(), GetParam().flags.end(), flag) > 0;
  }
};

// Samples between frames, from a fractional number on, and rates that are not whole: the export,
// imported without any flag, shows the same liquid at each time.
TEST_P(RoundTripTest, AnExportComesBackAsTheSameAnimation) {
  const std::string files = WriteFrames(
      "a", {"b_0001.5.ply", "b_0002.5.ply", "b_0003.ply", "b_0004.5.ply", "b_0005.5.ply"},
      TrackedBall({1.5, 2.5, 3, 4.5, 5.5}));
  ImportAndRegister("first", files,
                    {"--fps", absl::StrCat(GetParam().frames_per_second), "--vertex-scale", "1",
                     "--velocity-scale", "1", "--up", "y"});
  const std::string out = MakeFolder("out");
  std::vector<std::string> arguments = {"export", "first", "-w",       "0",
                                        "-o",     out,     "--format", GetParam().format};
  arguments.insert(arguments.end(), GetParam().flags.begin(), GetParam().flags.end());
  RunOrDie(arguments);
  ImportAndRegister("again", out);
  const nlohmann::json before = Inspect("families/first");
  const nlohmann::json after = Inspect("families/again");
  const double duration_s = before["durationS"].get<double>();
  EXPECT_NEAR(duration_s, 4 / GetParam().frames_per_second, 1e-9);
  EXPECT_NEAR(after["durationS"].get<double>(), duration_s, 1e-9);
  if (!HasFlag("--fps")) {
    EXPECT_EQ(after.at("framesPerSecond"), before.at("framesPerSecond"));
  }
  for (const double share : {0.0, 0.25, 0.6, 0.99}) {
    const cli::MeshStats one = Frame("first", 0, share * duration_s);
    const cli::MeshStats other = Frame("again", 0, share * duration_s);
    EXPECT_NEAR(CentreX(one), CentreX(other), 0.02) << share;
    EXPECT_NEAR(one.volume_m3 / other.volume_m3, 1.0, 0.03) << share;
  }
  EXPECT_EQ(Inspect("animations/again-a")["up"], "UP_Y");
  EXPECT_EQ(after.value("hasVelocities", false), HasFlag("--velocities"));
}

INSTANTIATE_TEST_SUITE_P(
    Formats, RoundTripTest,
    ::testing::Values(RoundTrip{"Ply", "ply", {}, 30},
                      RoundTrip{"PlyVelocities", "ply", {"--velocities"}, 23.976},
                      RoundTrip{"Obj", "obj", {}, 23.976},
                      RoundTrip{"Vdb", "vdb", {"--velocities", "--voxel-size", "0.06"}, 24},
                      RoundTrip{"Bobj", "bobj", {}, 30},
                      RoundTrip{"BobjAtAnotherRate", "bobj", {"--fps", "60"}, 15}),
    [](const auto& param) { return param.param.name; });

class GapsTest : public InputsTest, public ::testing::WithParamInterface<bool> {};

TEST_P(GapsTest, LiquidGoesOnThroughMissingFramesAndSamplesBetween) {
  const auto ball = GetParam() ? RebuiltBall : TrackedBall;
  const std::string a = WriteFrames("a", {"a_0001.ply", "a_0002.ply", "a_0004.ply", "a_0006.ply"},
                                    ball({1, 2, 4, 6}));
  const std::string b =
      WriteFrames("b", {"b_0001.ply", "b_0001.5.ply", "b_0003.ply", "b_0004.25.ply", "b_0006.ply"},
                  ball({1, 1.5, 3, 4.25, 6}));
  const CommandResult refused = Run({"import", "refused", a});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.err, HasSubstr("frame 3 is missing"));
  EXPECT_THAT(RunOrDie({"import", "a", a, "--allow-gaps"}),
              HasSubstr("Frame numbers that are missing: 2, the first is 3"));
  RunOrDie({"import", "b", b});
  Register({"f", "--source", "a", "--target", "b", "--iterations", "5"});
  const double volume = 4.0 / 3.0 * 3.14159 * kRadius * kRadius * kRadius;
  for (const double weight : {0.0, 0.5, 1.0}) {
    // At frames, beside them, and in the gaps of either.
    for (const double time_frames : {0.0, 0.5, 1.5, 2.0, 2.6, 3.25, 4.0, 5.0}) {
      const cli::MeshStats stats = Frame("f", weight, time_frames / 24);
      const std::string where = absl::StrCat("weight ", weight, ", frame ", 1 + time_frames);
      EXPECT_TRUE(stats.closed()) << where;
      EXPECT_EQ(stats.num_components, 1) << where;
      EXPECT_NEAR(stats.volume_m3 / volume, 1.0, 0.05) << where;
      EXPECT_NEAR(CentreX(stats), kSpeed * time_frames / 24, 0.03) << where;  // a frame is 0.125
    }
  }
}

// Lists as long as the duration once took 22 GB.
TEST_P(GapsTest, AbsurdTimesAreRefusedAndLongGapsBridged) {
  const auto ball = GetParam() ? RebuiltBall : TrackedBall;
  const std::string frames = WriteFrames("a", {"a_1.ply", "a_2.ply", "a_3.ply"}, ball({1, 2, 3}));
  const std::string numbers =
      WriteFrames("n", {"a_1.ply", "a_2.ply", "a_999999999.ply"}, ball({1, 2, 3}));
  EXPECT_THAT(Run({"import", "t", frames, "--frame-times", "0,1,1000000000"}).err,
              HasSubstr("frame_times[2] is 1000000000, not a time up to 100000"));
  EXPECT_THAT(Run({"import", "n", numbers, "--allow-gaps"}).err,
              HasSubstr("frame 999999999 comes more than 100000 frames after frame 1"));
  // So slow that its positions meet across the gap.
  const std::vector<std::string> times = {"--frame-times", "0,1,251", "--fps", "3000"};
  const auto import = [&](const std::string& name, const std::string& folder) {
    std::vector<std::string> arguments = {"import", name, folder};
    arguments.insert(arguments.end(), times.begin(), times.end());
    RunOrDie(arguments);
  };
  import("a", frames);
  import("b", frames);
  Register({"f", "--source", "a", "--target", "b", "--iterations", "2"});
  EXPECT_TRUE(Frame("f", 0.5, 125.0 / 3000).closed());
}

INSTANTIATE_TEST_SUITE_P(Frames, GapsTest, ::testing::Bool(), [](const auto& param) {
  return std::string(param.param ? "Rebuilt" : "Tracked");
});

}  // namespace
}  // namespace liquidblend::e2e
