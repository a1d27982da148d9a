// meta.json: the keys that are read and refused, and the notes about what it leaves open.
#include "worker/ingest/meta.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"
#include "tests/paths.h"
#include "tests/synthetic/shapes.h"
#include "tests/worker/ingest/formats/encode_files.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::ingest::meta_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string Error(const std::string& text) {
  const absl::StatusOr<Meta> meta = ReadMeta(ToBytes(text));
  return meta.ok() ? "no error" : std::string(meta.status().message());
}

absl::StatusOr<mesh::Animation> Read(Format format, const std::string& meta,
                                     const ImportOptions& options) {
  std::vector<LoadedFile> files =
      Files(synthetic::MovingSphere({.num_frames = 3, .subdivisions = 1}), format);
  if (!meta.empty()) files.push_back({"meta.json", ToBytes(meta)});
  return ReadAnimation("test", Views(files), options, parallel::Arena(2));
}

std::vector<std::string> Notes(Format format, const std::string& meta,
                               const ImportOptions& options) {
  const absl::StatusOr<mesh::Animation> read = Read(format, meta, options);
  return read.ok() ? read->notes : std::vector<std::string>{std::string(read.status().message())};
}

TEST(ReadMeta, RefusesUnknownKeysByName) {
  EXPECT_THAT(
      Error(R"({"frame_rate": 30})"),
      HasSubstr(R"(key "frame_rate" is not known; known are fps, frame_times, up, units, )"));
  EXPECT_THAT(Error(R"({"units": {"scale": 30}})"),
              HasSubstr(R"(key "units.scale" is not known; known are vertex_scale, velocity_sca)"));
  EXPECT_EQ(Error(R"({"about": {"frame_rate": 30}})"), "no error");
}

TEST(ReadMeta, RefusesUnitsThatAreAWord) {
  EXPECT_THAT(Error(R"({"units": "cm"})"),
              HasSubstr(R"(units is "cm", not an object such as {"vertex_scale": 0.01})"));
}

TEST(ReadMeta, ValuesThatAreNestedDeeplyDoNotUseUpTheStack) {
  const std::string deep = std::string(30'000, '[') + std::string(30'000, ']');
  EXPECT_EQ(Error("{\"fps\": " + deep + "}"), "fps is a nested array, not a number above 0");
  EXPECT_EQ(Error("{\"units\": {\"vertices\": " + deep + ", \"vertex_scale\": 1}}"), "no error");
  EXPECT_EQ(Error(R"({"domain_size_m": [1, 2]})"), "domain_size_m is \"[1,2]\", not three numbers");
}

TEST(ReadMeta, KnowsTheKeysOfTheSampleSimulations) {
  for (const char* name : {"A", "B", "MID"}) {
    std::ifstream file(paths::Source(absl::StrCat("tests/data/two_drops/", name, "/meta.json")));
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const absl::StatusOr<Meta> meta = ReadMeta(ToBytes(text));
    ASSERT_TRUE(meta.ok()) << meta.status();
    EXPECT_GT(meta->frames_per_second, 0.0);
    EXPECT_GT(meta->vertex_scale, 0.0);
  }
}

TEST(ReadAnimation, SaysWhatItAssumes) {
  EXPECT_THAT(Notes(Format::kObj, "", {}),
              ElementsAre("Assumed 24 frames per second and positions in metres, as neither "
                          "options (--fps, --vertex-scale) nor a meta.json say so."));
  EXPECT_THAT(Notes(Format::kObj, "", {.vertex_scale = 1}),
              ElementsAre("Assumed 24 frames per second, as neither options (--fps) nor a "
                          "meta.json say so."));
  EXPECT_THAT(Notes(Format::kObj, R"({"fps": 24})", {}),
              ElementsAre("Assumed positions in metres, as neither options (--vertex-scale) nor a "
                          "meta.json say so."));
  EXPECT_THAT(Notes(Format::kObj, R"({"fps": 24, "units": {"vertex_scale": 1}})", {}), IsEmpty());
  EXPECT_THAT(Notes(Format::kMantaflow,
                    R"({"fps": 24, "domain_size_m": [1, 2, 3], "voxel_size_m": 0.4})", {}),
              IsEmpty());
}

// PLY files have velocities.
TEST(ReadAnimation, SaysWhichUnitOfVelocitiesItAssumes) {
  EXPECT_THAT(Notes(Format::kPly, "", {}),
              ElementsAre("Assumed 24 frames per second, positions in metres and velocities in the "
                          "unit of positions per second, as neither options (--fps, "
                          "--vertex-scale, --velocity-scale) nor a meta.json say so."));
  EXPECT_THAT(Notes(Format::kPly, R"({"fps": 24})", {.vertex_scale = 0.01}),
              ElementsAre("Assumed velocities in the unit of positions per second, as neither "
                          "options (--velocity-scale) nor a meta.json say so."));
  EXPECT_THAT(Notes(Format::kPly, R"({"fps": 24})", {.vertex_scale = 1, .velocity_scale = 1}),
              IsEmpty());
  EXPECT_THAT(Notes(Format::kPly,
                    R"({"fps": 24,
                        "units": {"vertex_scale": 1, "velocity_scale_to_m_per_s": 1}})",
                    {}),
              IsEmpty());
}

TEST(ReadAnimation, RefusesAUnitOfPositionsWhoseScaleIsNotGiven) {
  const std::string centimetres = R"({"fps": 24, "units": {"vertices": "cm"}})";
  EXPECT_THAT(Notes(Format::kObj, centimetres, {}),
              ElementsAre(HasSubstr("meta.json: units.vertices is \"cm\", not metres: "
                                    "give units.vertex_scale too, or --vertex-scale")));
  EXPECT_THAT(Notes(Format::kObj, centimetres, {.vertex_scale = 0.01}), IsEmpty());
  EXPECT_THAT(
      Notes(Format::kObj, R"({"fps": 24, "units": {"vertices": "cm", "vertex_scale": 0.01}})", {}),
      IsEmpty());
  EXPECT_THAT(Notes(Format::kObj, R"({"fps": 24, "units": {"vertices": "Metres"}})", {}),
              IsEmpty());
}

TEST(ReadAnimation, TakesUpFromGravity) {
  const auto up_with = [](const std::string& meta, mesh::Up given) {
    const auto read = Read(Format::kObj, meta, {.vertex_scale = 1, .up = given});
    EXPECT_TRUE(read.ok()) << read.status();
    return read.ok() ? read->up : mesh::Up::kUnknown;
  };
  const std::string along_y = R"({"fps": 24, "gravity": [0, -9.81, 0.0001]})";
  EXPECT_EQ(up_with(along_y, mesh::Up::kUnknown), mesh::Up::kY);
  EXPECT_EQ(up_with(R"({"fps": 24, "gravity": [3, 0, 0]})", mesh::Up::kUnknown), mesh::Up::kMinusX);
  for (const char* none : {"[0, -9.81, -9.81]", "[0, 0, 0]", "9.81", "[0, 0]", "[0, 0, null]"}) {
    EXPECT_EQ(up_with(absl::StrCat("{\"gravity\": ", none, "}"), mesh::Up::kUnknown),
              mesh::Up::kUnknown)
        << none;
  }
  EXPECT_EQ(up_with(along_y, mesh::Up::kZ), mesh::Up::kZ);
  EXPECT_EQ(up_with(R"({"up": "z", "gravity": [0, -1, 0]})", mesh::Up::kUnknown), mesh::Up::kZ);
  EXPECT_THAT(Notes(Format::kObj, along_y, {.vertex_scale = 1, .up = mesh::Up::kZ}),
              ElementsAre("Took z as up, as given, although gravity in meta.json points against "
                          "y."));
  EXPECT_THAT(Notes(Format::kObj, along_y, {.vertex_scale = 1, .up = mesh::Up::kY}), IsEmpty());
}

}  // namespace
}  // namespace liquidblend::ingest::meta_test
