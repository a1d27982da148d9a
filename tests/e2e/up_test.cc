// Which way is up, from the files to the registration and the pictures.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stb/stb_image.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/synthetic/shapes.h"
#include "tests/synthetic/turned.h"
#include "tests/worker/ingest/formats/encode_files.h"

namespace liquidblend::e2e {
namespace {

using liquidblend::testing::CommandResult;
using liquidblend::testing::TempDir;
using mesh::Up;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

constexpr int kNumFrames = 10;

// A ball that falls beside a block: z is up.
mesh::TriangleMesh FallingBall(double start_height_m, int frame) {
  const float time_s = static_cast<float>(frame) / 24;
  const float height_m = static_cast<float>(start_height_m) - 9.81f * time_s * time_s / 2;
  mesh::TriangleMesh block = synthetic::Box({-1, -0.6f, 0}, {1, 0.6f, 0.6f}, 8);
  mesh::TriangleMesh ball = synthetic::Icosphere({0.2f, 0, height_m}, 0.25, 2);
  block.velocities = Eigen::Matrix3Xf::Zero(3, block.num_vertices());
  ball.velocities = Eigen::Vector3f(0, 0, -9.81f * time_s).replicate(1, ball.num_vertices());
  const mesh::TriangleMesh parts[] = {block, ball};
  return synthetic::Join(parts);
}

class UpTest : public E2eTest {
 protected:
  UpTest() {
    lease_ = "30s";  // no worker is lost here
    server_ = StartServer(/*num_workers=*/1);
  }

  CommandResult Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--server", Address(), "--quiet"});
    return liquidblend::testing::RunLiquidblend(arguments);
  }

  // The output.
  std::string RunOrDie(const std::vector<std::string>& arguments) const {
    const CommandResult result = Run(arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments[0] << ": " << result.err;
    return result.out;
  }

  // Writes a folder of PLY frames in which `up` is up.
  std::string WriteFall(const std::string& name, double start_height_m, Up up) const {
    std::filesystem::create_directory(folder_.File(name));
    for (int k = 0; k < kNumFrames; ++k) {
      const ingest::Bytes bytes = ingest::Ply(synthetic::Turned(FallingBall(start_height_m, k), up),
                                              ingest::PlyKind::kLittleEndian);
      folder_.Write(name + "/ball_" + std::to_string(10 + k) + ".ply",
                    {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    }
    return folder_.File(name);
  }

  std::string UpOf(const std::string& what) const {
    return Json::parse(RunOrDie({"inspect", what, "--json"})).value("up", "UP_UNSPECIFIED");
  }

  void Register(const std::string& family, const std::string& source,
                const std::string& target) const {
    RunOrDie({"register", family, "--source", source, "--target", target, "--wait", "--iterations",
              "3", "--connectivity", "rebuilt"});
  }

  // Grey values of a picture of the half-way blend.
  std::vector<unsigned char> Picture(const std::string& name,
                                     std::vector<std::string> more = {}) const {
    const std::string path = folder_.File(name + ".png");
    std::vector<std::string> arguments = {"render",    name.substr(0, name.find('-')),
                                          "-w",        "0.5",
                                          "--size",    "120x120",
                                          "-o",        path,
                                          "--columns", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    RunOrDie(arguments);
    int width = 0, height = 0, channels = 0;
    unsigned char* const pixels = stbi_load(path.c_str(), &width, &height, &channels, 1);
    EXPECT_NE(pixels, nullptr) << path;
    if (pixels == nullptr) return {};
    std::vector<unsigned char> grey(pixels, pixels + width * height);
    stbi_image_free(pixels);
    return grey;
  }

  TempDir folder_;
  Process server_;
};

double MeanDifference(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0;
  for (size_t n = 0; n < a.size() && n < b.size(); ++n) sum += std::abs(a[n] - b[n]);
  return sum / static_cast<double>(a.size());
}

TEST_F(UpTest, IsFoundFromTheFallAndGoesIntoTheFamilyAndItsPictures) {
  EXPECT_THAT(RunOrDie({"import", "a", WriteFall("a", 3.0, Up::kMinusX)}),
              AllOf(HasSubstr(", -x up"), HasSubstr("Took -x as up: falling parts show")));
  RunOrDie({"import", "b", WriteFall("b", 2.6, Up::kMinusX)});
  EXPECT_EQ(UpOf("animations/a"), "UP_MINUS_X");
  Register("f", "a", "b");
  EXPECT_EQ(UpOf("families/f"), "UP_MINUS_X");
  EXPECT_THAT(RunOrDie({"inspect", "f"}), HasSubstr(", -x up"));

  RunOrDie({"import", "upright_a", WriteFall("upright_a", 3.0, Up::kZ)});
  RunOrDie({"import", "upright_b", WriteFall("upright_b", 2.6, Up::kZ)});
  Register("upright", "upright_a", "upright_b");
  // From behind: then the same side is seen.
  const std::vector<unsigned char> expected = Picture("upright", {"--camera", "180,16"});
  const std::vector<unsigned char> found = Picture("f");
  const std::vector<unsigned char> lying = Picture("f-lying", {"--up", "z"});
  EXPECT_LT(MeanDifference(found, expected), 4);
  EXPECT_GT(MeanDifference(lying, expected), 8);
}

TEST_F(UpTest, IsTakenFromMetaAndFlagsAndMustBeOneInAFamily) {
  const std::string folder = WriteFall("a", 3.0, Up::kY);
  EXPECT_THAT(RunOrDie({"import", "a", folder, "--up", "y"}),
              AllOf(HasSubstr(", y up"), Not(HasSubstr("as up"))));
  EXPECT_THAT(RunOrDie({"import", "minus", folder, "--up", "-y"}),
              HasSubstr("Took -y as up, as given, although falling parts show that y is up"));
  folder_.Write("a/meta.json", R"({"fps": 24, "up": "z"})");
  RunOrDie({"import", "b", folder});
  EXPECT_EQ(UpOf("animations/b"), "UP_Z");
  const CommandResult refused =
      Run({"register", "f", "--source", "a", "--target", "b", "--wait", "--iterations", "1"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err,
              HasSubstr("animation 'b' has z up, but the source 'a' has y up; import the one"));
  EXPECT_NE(Run({"inspect", "families/f"}).exit_code, 0) << "no job was made";
  folder_.Write("a/meta.json", R"({"fps": 24, "up": "upward"})");
  EXPECT_THAT(Run({"import", "c", folder}).err, HasSubstr("not x, y, z, -x, -y or -z"));
}

TEST_F(UpTest, IsAssumedToBeZWhereNothingFalls) {
  std::filesystem::create_directory(folder_.File("still"));
  for (const char* name : {"still/s_1.ply", "still/s_2.ply", "still/s_3.ply"}) {
    const ingest::Bytes bytes = ingest::Ply(FallingBall(2, 0), ingest::PlyKind::kLittleEndian);
    folder_.Write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  EXPECT_THAT(RunOrDie({"import", "a", folder_.File("still")}),
              AllOf(HasSubstr("z (assumed) up"), HasSubstr("Assumed that z is up")));
  EXPECT_EQ(UpOf("animations/a"), "UP_UNSPECIFIED");
}

}  // namespace
}  // namespace liquidblend::e2e
