// `liquidblend export` in formats that hold all frames in few files, and along curves, with a
// server of canned answers: an octahedron of radius 1 + weight about (time, 0, 0). Whether other
// programs read the files is tested in tests/e2e/web.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "client/vdb/write_vdb.h"
#include "tests/client/fake_server.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"

namespace liquidblend::cli {
namespace {

using Json = ::nlohmann::json;
using testing::CommandResult;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

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
  EXPECT_THAT(server_.LastRequest(), AllOf(HasSubstr("version: 3"), HasSubstr("time_s: 1\n"),
                                           HasSubstr("position_bits: 20")));
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

// The parts of a GLB.
struct Glb {
  Json document;
  std::string binary;

  explicit Glb(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(WordAt(bytes, 8), bytes.size());
    const size_t json_size = WordAt(bytes, 12);
    document = Json::parse(bytes.substr(20, json_size));
    EXPECT_EQ(WordAt(bytes, 20 + json_size), bytes.size() - 28 - json_size);
    binary = bytes.substr(28 + json_size);
    EXPECT_EQ(document["buffers"][0]["byteLength"], binary.size());
  }

  static uint32_t WordAt(const std::string& bytes, size_t offset) {
    uint32_t word = 0;
    std::memcpy(&word, &bytes[offset], sizeof(word));
    return word;
  }

  // Numbers of an accessor, `size` bytes each.
  template <typename T>
  std::vector<double> Values(const Json& index, size_t num_components) const {
    const Json& accessor = document["accessors"][index.get<size_t>()];
    const Json& view = document["bufferViews"][accessor["bufferView"].get<size_t>()];
    const size_t offset = view["byteOffset"].get<size_t>() + accessor.value("byteOffset", 0U);
    std::vector<T> values(accessor["count"].get<size_t>() * num_components);
    std::memcpy(values.data(), &binary[offset], values.size() * sizeof(T));
    return {values.begin(), values.end()};
  }

  // Frames that are shown at a time, by scale or by visibility: STEP.
  std::vector<size_t> ShownAt(double time_s, bool by_scale) const {
    std::vector<size_t> shown;
    const Json& animation = document["animations"][0];
    for (const Json& channel : animation["channels"]) {
      if ((channel["target"]["path"] == "scale") != by_scale) continue;
      const Json& sampler = animation["samplers"][channel["sampler"].get<size_t>()];
      EXPECT_EQ(sampler["interpolation"], "STEP");
      const std::vector<double> times = Values<float>(sampler["input"], 1);
      const std::vector<double> values =
          by_scale ? Values<float>(sampler["output"], 3) : Values<uint8_t>(sampler["output"], 1);
      size_t key = 0;
      while (key + 1 < times.size() && times[key + 1] <= time_s) ++key;
      if (values[key * (by_scale ? 3 : 1)] != 0.0) shown.push_back(NodeOf(channel));
    }
    return shown;
  }

  static size_t NodeOf(const Json& channel) {
    const Json& target = channel["target"];
    if (target.contains("node")) return target["node"];
    const std::string pointer = target["extensions"]["KHR_animation_pointer"]["pointer"];
    return std::stoul(pointer.substr(std::strlen("/nodes/")));
  }
};

TEST_F(ExportFormats, AGlbShowsExactlyOneFrameAtATime) {
  ASSERT_EQ(Run({"--fps", "4", "--format", "gltf"}, "0:0/1:1").exit_code, 0);
  EXPECT_THAT(testing::ListFolder(Out()), ElementsAre("animation.glb", "meta.json"));
  const Glb glb(Read("animation.glb"));
  EXPECT_EQ(glb.document["nodes"].size(), 6U);
  for (int k = 0; k < 50; ++k) {
    const double time_s = 0.025 * k + 0.001;
    const size_t node = std::min<size_t>(static_cast<size_t>(time_s * 4), 4) + 1;
    EXPECT_THAT(glb.ShownAt(time_s, true), ElementsAre(node)) << time_s;
    EXPECT_THAT(glb.ShownAt(time_s, false), ElementsAre(node)) << time_s;
  }
  const Json& root = glb.document["nodes"][0];
  EXPECT_EQ(root["name"], "families/drops");
  EXPECT_EQ(root["rotation"], Json({1.0, 0.0, 0.0, 0.0})) << "-y is up";
  EXPECT_EQ(glb.document["nodes"][1]["scale"], Json({1.0, 1.0, 1.0}));
  EXPECT_EQ(glb.document["nodes"][2]["scale"], Json({0.0, 0.0, 0.0}));
}

TEST_F(ExportFormats, AGlbHasThePositionsOfThePlyExport) {
  ASSERT_EQ(Run({"--fps", "1", "--format", "gltf"}).exit_code, 0);
  const Glb glb(Read("animation.glb"));
  ASSERT_EQ(Run({"--fps", "1", "--overwrite"}).exit_code, 0);
  EXPECT_THAT(testing::ListFolder(Out()),
              ElementsAre("frame_0001.ply", "frame_0002.ply", "meta.json"));
  for (size_t frame = 0; frame < 2; ++frame) {
    const auto ply = ReadMeshFile(absl::StrCat(Out(), "/frame_000", frame + 1, ".ply"));
    ASSERT_TRUE(ply.ok()) << ply.status();
    const Json& primitive = glb.document["meshes"][frame]["primitives"][0];
    const Json& position = primitive["attributes"]["POSITION"];
    const std::vector<double> values = glb.Values<float>(position, 3);
    EXPECT_EQ(std::vector<float>(values.begin(), values.end()), ply->positions);
    const std::vector<double> indices = glb.Values<uint16_t>(primitive["indices"], 1);
    EXPECT_EQ(std::vector<uint32_t>(indices.begin(), indices.end()), ply->triangles);
    const Bounds bounds = ComputeMeshStats(*ply).bounds;
    const Json& accessor = glb.document["accessors"][position.get<size_t>()];
    EXPECT_EQ(accessor["max"], Json({bounds.max.x, bounds.max.y, bounds.max.z}));
    EXPECT_EQ(accessor["min"], Json({bounds.min.x, bounds.min.y, bounds.min.z}));
  }
}

TEST_F(ExportFormats, ADracoGlbHoldsTheServersBytes) {
  ASSERT_EQ(Run({"--fps", "1", "--format", "gltf", "--compression", "draco"}).exit_code, 0);
  const Glb glb(Read("animation.glb"));
  EXPECT_THAT(glb.document["extensionsRequired"], ElementsAre("KHR_draco_mesh_compression"));
  const Json& primitive = glb.document["meshes"][0]["primitives"][0];
  const Json& draco = primitive["extensions"]["KHR_draco_mesh_compression"];
  EXPECT_EQ(draco["attributes"], Json({{"POSITION", 0}}));
  const Json& view = glb.document["bufferViews"][draco["bufferView"].get<size_t>()];
  EXPECT_EQ(glb.binary.substr(view["byteOffset"], view["byteLength"]),
            testing::EncodeDraco(testing::MakeOctahedron(0.5, 0.0), 20));
  const auto accessor = [&](const Json& index) {
    return glb.document["accessors"][index.get<size_t>()];
  };
  EXPECT_EQ(accessor(primitive["attributes"]["POSITION"])["count"], 6);
  EXPECT_FALSE(accessor(primitive["attributes"]["POSITION"]).contains("bufferView"));
  EXPECT_EQ(accessor(primitive["indices"])["count"], 24);
}

TEST_F(ExportFormats, UsdaHasASampleForEachFrame) {
  ASSERT_EQ(Run({"--fps", "2", "--format", "usda"}).exit_code, 0);
  const std::string text = Read("animation.usda");
  EXPECT_EQ(text.substr(0, 10), "#usda 1.0\n");
  EXPECT_THAT(text, HasSubstr("    endTimeCode = 2\n    framesPerSecond = 2\n"));
  EXPECT_THAT(text, HasSubstr("upAxis = \"Y\"\n"));
  EXPECT_THAT(text, HasSubstr("float3 xformOp:rotateXYZ = (180, 0, 0)\n")) << "-y is up";
  for (const char* name : {"float3[] extent", "int[] faceVertexCounts", "int[] faceVertexIndices",
                           "point3f[] points"}) {
    const size_t begin = text.find(absl::StrCat(name, ".timeSamples = {\n"));
    ASSERT_NE(begin, std::string::npos) << name;
    const std::string samples = text.substr(begin, text.find("}\n", begin) - begin);
    for (const char* code : {"\n            0: [", "\n            1: [", "\n            2: ["}) {
      EXPECT_THAT(samples, HasSubstr(code)) << name;
    }
  }
  EXPECT_THAT(text, Not(HasSubstr("normals")));
}

TEST_F(ExportFormats, VatSaysHowItsTexturesAreRead) {
  ASSERT_EQ(Run({"--fps", "2", "--format", "vat"}).exit_code, 0);
  EXPECT_THAT(testing::ListFolder(Out()),
              ElementsAre("meta.json", "vat.json", "vat_positions.exr", "vat_triangles.exr"));
  const Json vat = Json::parse(Read("vat.json"));
  EXPECT_EQ(vat["num_frames"], 3);
  EXPECT_EQ(vat["max_triangles"], 8);
  EXPECT_EQ(vat["up"], "-y");
  const Json& triangles = vat["textures"]["triangles"];
  EXPECT_EQ(triangles["width"], 4);
  EXPECT_EQ(triangles["rows_per_frame"], 2);
  EXPECT_NEAR(vat["bounds"]["max"][0].get<double>(), 2.5, 1e-4);
}

TEST_F(ExportFormats, VatRefusesMoreThanATextureHoldsAndLeavesNothing) {
  const CommandResult result =
      Run({"--fps", "1100", "--format", "vat", "--texture-size", "1024"}, "0:0/1:1");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("1025 frames of up to 8 triangles do not fit into a texture of "
                                    "1024 x 1024; use a coarser level (--lod)"));
  EXPECT_THAT(testing::ListFolder(Out()), IsEmpty());
}

TEST_F(ExportFormats, AFileOfTheSameNameThatNoExportHasWrittenStays) {
  dir_.Write("animation.glb", "mine");
  std::filesystem::create_directory(Out());
  std::filesystem::rename(dir_.File("animation.glb"), Out() + "/animation.glb");
  const CommandResult result = Run({"--format", "gltf", "--overwrite"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("holds animation.glb, which the export would replace"));
  EXPECT_EQ(Read("animation.glb"), "mine");
}

TEST_F(ExportFormats, AnExportReplacesAnEarlierOneOfOneFile) {
  for (const char* format : {"gltf", "usda", "vat", "gltf"}) {
    ASSERT_EQ(Run({"--format", format, "--fps", "1", "--overwrite"}).exit_code, 0) << format;
  }
  EXPECT_THAT(testing::ListFolder(Out()), ElementsAre("animation.glb", "meta.json"));
}

TEST_F(ExportFormats, FlagsOfAnotherFormatAreRefused) {
  EXPECT_THAT(Run({"--compression", "draco"}).err,
              HasSubstr("--compression draco is for --format gltf, not for ply"));
  EXPECT_THAT(Run({"--format", "usda", "--voxel-size", "0.1"}).err,
              HasSubstr("--voxel-size is for --format vdb, not for usda"));
}

// What is in it is tested by importing it: RoundTripTest of tests/e2e/inputs_test.cc.
TEST_F(ExportFormats, VdbWritesALevelSetAFrame) {
  const CommandResult result =
      Run({"--format", "vdb", "--velocities", "--voxel-size", "0.2", "--fps", "1"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(testing::ListFolder(Out()),
              ElementsAre("frame_0001.vdb", "frame_0002.vdb", "meta.json"));
  EXPECT_EQ(Read("frame_0001.vdb").substr(0, 4), std::string("\x20\x42\x44\x56"));
  const CommandResult fine = Run({"--format", "vdb", "--voxel-size", "1e-5", "--overwrite"});
  EXPECT_EQ(fine.exit_code, 2);
  EXPECT_THAT(fine.err, HasSubstr("--voxel-size 1e-05: a surface of "));
}

TEST(WriteVdb, TellsThatADiskIsFull) {
  namespace fs = std::filesystem;
  const fs::path programs = fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "bin";
  void* const module = dlopen((programs / "liquidblend_vdb.so").c_str(), RTLD_NOW | RTLD_LOCAL);
  ASSERT_NE(module, nullptr) << dlerror();
  const auto write = reinterpret_cast<vdb::WriteFunction>(dlsym(module, vdb::kWriteFunctionName));
  const Mesh mesh = testing::MakeOctahedron(0.0, 0.0);
  vdb::WriteRequest request;
  request.positions = mesh.positions.data();
  request.num_vertices = mesh.num_vertices();
  request.triangles = mesh.triangles.data();
  request.num_triangles = mesh.num_triangles();
  request.velocities = nullptr;
  request.voxel_size_m = 0.2;
  request.path = "/dev/full";
  const char* const error = write(&request);
  ASSERT_NE(error, nullptr);
  EXPECT_THAT(error, HasSubstr("is the disk full?"));
}

TEST_F(ExportFormats, TheSizeOfTexturesIsForTexturesAlone) {
  const CommandResult result = Run({"--format", "gltf", "--texture-size", "4096"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--texture-size is for --format vat"));
}

TEST_F(ExportFormats, VelocitiesAreRefusedWhereTheyHaveNoPlace) {
  EXPECT_EQ(Run({"--format", "stl", "--velocities"}).exit_code, 2);
  const CommandResult vat = Run({"--format", "vat", "--rest-positions"});
  EXPECT_EQ(vat.exit_code, 2);
  EXPECT_THAT(vat.err, HasSubstr("--rest-positions: .vat files do not hold them"));
  EXPECT_EQ(Run({"--format", "gltf", "--velocities", "--fps", "1"}).exit_code, 0);
}

}  // namespace
}  // namespace liquidblend::cli
