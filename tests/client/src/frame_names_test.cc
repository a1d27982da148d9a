// Names that make no sequence: refused before an upload with the words of an import.
#include "client/src/frame_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "worker/ingest/frame_files.h"
#include "worker/ingest/frame_times.h"

namespace liquidblend::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Case {
  std::string name;
  std::vector<std::string> names;
  std::string message;  // what both say; empty: both take the names
  NumberRule rule = NumberRule::kNoGaps;
  AnimationFormat format = AnimationFormat::kAny;
  ingest::Format ingest_format = ingest::Format::kAny;
};

absl::Status CheckInWorker(const Case& c) {
  std::vector<ingest::InputFile> files;
  for (const std::string& name : c.names) files.push_back({name, {}});
  const absl::StatusOr<ingest::FrameSequence> sequence = ingest::FindFrames(files, c.ingest_format);
  if (!sequence.ok()) return sequence.status();
  std::vector<double> times;
  if (c.rule == NumberRule::kTimesGiven) {
    for (size_t k = 0; k < sequence->frames.size(); ++k) times.push_back(static_cast<double>(k));
  }
  return ingest::FindFrameTimes(*sequence, times, c.rule == NumberRule::kGapsAllowed).status();
}

class FrameNames : public ::testing::TestWithParam<Case> {};

TEST_P(FrameNames, AreJudgedAsByAnImport) {
  const Case& c = GetParam();
  for (const absl::Status& status :
       {CheckFrameNames(c.names, c.format, c.rule), CheckInWorker(c)}) {
    if (c.message.empty()) {
      EXPECT_TRUE(status.ok()) << status;
    } else {
      EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
      EXPECT_THAT(std::string(status.message()), HasSubstr(c.message));
    }
  }
}

// Frames of one sequence, and numbers that are wrong.
std::vector<Case> NumberCases() {
  return {
      {"Plain", {"a_0001.ply", "a_0002.ply", "meta.json"}, ""},
      {"Capitals", {"a_1.OBJ", "a_2.obj"}, ""},
      {"NoPrefix", {"0009.ply", "0010.ply"}, ""},
      {"NumberedRun", {"run2.0001.ply", "run2.0002.ply"}, ""},
      {"Fractions", {"a_1.ply", "a_1.5.ply", "a_3.25.ply"}, ""},
      {"Halves", {"a_1.0.ply", "a_1.5.ply", "a_2.0.ply", "a_2.5.ply"}, ""},
      {"Quarters", {"a_1.5.ply", "a_1.75.ply", "a_2.25.ply", "a_2.5.ply", "a_2.75.ply"}, ""},
      {"Thirds", {"a_1.33.ply", "a_1.67.ply", "a_2.ply", "a_2.33.ply", "a_2.67.ply"}, ""},
      {"EvenlySpacedTimes", {"a_1.98.ply", "a_1.99.ply", "a_2.00.ply", "a_2.01.ply"}, ""},
      {"UnevenTimes", {"a_1.13.ply", "a_1.57.ply", "a_2.04.ply", "a_2.61.ply"}, ""},
      {"TimesBesideWholeFrames", {"a_1.1.ply", "a_1.2.ply", "a_2.ply", "a_3.5.ply"}, ""},
      {"Gap", {"a_1.ply", "a_4.ply"}, "frame 2 is missing: a_4.ply comes right after a_1.ply"},
      {"GapThatIsAllowed", {"a_1.ply", "a_4.ply"}, "", NumberRule::kGapsAllowed},
      {"Twice", {"a_01.ply", "a_1.ply"}, "frame 1 is there twice: a_01.ply and a_1.ply"},
      {"NoNumber", {"a.ply"}, "a.ply: no frame number of 1 to 9 digits"},
      {"LongNumber", {"a_1234567890.ply"}, "a_1234567890.ply: no frame number of 1 to 9 digits"},
      {"NoFrame", {"meta.json"}, "none of the 1 files is a frame"},
  };
}

// Frames of two sequences, or names that look so.
std::vector<Case> SequenceCases() {
  return {
      {"TwoRuns",
       {"run1.01.ply", "run1.02.ply", "run2.01.ply", "run2.02.ply"},
       "frames of two sequences, run1.01.ply and run2.01.ply"},
      {"TwoRunsOfDifferentLengths",
       {"run1.1.ply", "run1.2.ply", "run1.3.ply", "run2.2.ply", "run2.3.ply"},
       "frames of two sequences, run1.2.ply and run2.2.ply"},
      {"TwoRunsWithoutACommonNumber",
       {"run1.08.ply", "run1.09.ply", "run2.10.ply", "run2.11.ply", "run2.12.ply"},
       "frames of two sequences, run1.08.ply and run2.10.ply"},
      {"TwoRunsWithoutACommonNumberNorZeros",
       {"run1.1.ply", "run1.2.ply", "run10.3.ply", "run10.4.ply"},
       "frames of two sequences, run1.1.ply and run10.3.ply"},
      {"TwoRunsWhoseTimesAreGiven",
       {"run1.08.ply", "run1.09.ply", "run2.10.ply", "run2.11.ply"},
       "",
       NumberRule::kTimesGiven},
      {"RunsOfWhichOneHasNoNumberNorACommonOne",
       {"run.01.ply", "run.02.ply", "run2.03.ply", "run2.04.ply"},
       "frames of two sequences, run.01.ply and run2.03.ply"},
      {"RunsOfWhichOneHasNoNumber",
       {"run.01.ply", "run.02.ply", "run2.01.ply", "run2.02.ply"},
       "frames of two sequences, run.01.ply and run2.01.ply"},
      {"TwoRunsThatCouldBeTenths",
       {"r1.0.ply", "r1.1.ply", "r1.2.ply", "r1.3.ply", "r1.4.ply", "r1.5.ply", "r1.6.ply",
        "r1.7.ply", "r1.8.ply", "r1.9.ply", "r2.0.ply", "r2.1.ply"},
       "frames of two sequences, r1.0.ply and r2.0.ply",
       NumberRule::kGapsAllowed},
      {"NumbersWhoseTimesAreGiven",
       {"run1.01.ply", "run1.02.ply", "run2.01.ply", "run2.02.ply"},
       "",
       NumberRule::kTimesGiven},
      {"TwoPrefixes",
       {"foam.0003.ply", "liquid.0001.ply"},
       "frames of two sequences, foam.0003.ply and liquid.0001.ply"},
      {"TwoPrefixesOfTheSameNumbers",
       {"foam.1.ply", "liquid.1.ply"},
       "frames of two sequences, foam.1.ply and liquid.1.ply"},
      {"TwoPrefixesWithNumbers",
       {"foam1.0001.ply", "liquid2.0002.ply"},
       "frames of two sequences, foam1.0001.ply and liquid2.0002.ply"},
  };
}

// Files of several formats, and velocities.
std::vector<Case> FormatCases() {
  return {
      {"Velocities", {"m_1.bobj.gz", "lVelMesh_0001.uni", "other.uni"}, ""},
      {"Formats",
       {"a_1.ply", "b_1.obj"},
       "files of several formats, a_1.ply and b_1.obj: say which to read (--format)"},
      {"ChosenFormat",
       {"a_1.ply", "b_1.obj"},
       "",
       NumberRule::kNoGaps,
       AnimationFormat::kObj,
       ingest::Format::kObj},
      {"SomeVelocities",
       {"m_1.bobj.gz", "m_2.bobj.gz", "lVelMesh_1.uni"},
       "frame 2: m_2.bobj.gz has no velocities, but other frames have (lVelMesh_1.uni)"},
      {"VelocitiesAlone",
       {"m_1.bobj.gz", "lVelMesh_1.uni", "lVelMesh_2.uni"},
       "frame 2: lVelMesh_2.uni has no mesh"},
  };
}

const auto kCaseName = [](const auto& param) { return param.param.name; };
INSTANTIATE_TEST_SUITE_P(Numbers, FrameNames, ::testing::ValuesIn(NumberCases()), kCaseName);
INSTANTIATE_TEST_SUITE_P(Sequences, FrameNames, ::testing::ValuesIn(SequenceCases()), kCaseName);
INSTANTIATE_TEST_SUITE_P(Formats, FrameNames, ::testing::ValuesIn(FormatCases()), kCaseName);

TEST(WithoutStrayVelocities, KeepsThoseOfTheFramesThatAreThere) {
  EXPECT_THAT(WithoutStrayVelocities({"m_0002.bobj.gz", "lVelMesh_0001.uni", "lVelMesh_0002.uni",
                                      "lVelMesh_0003.uni", "other.uni", "meta.json"}),
              ElementsAre("m_0002.bobj.gz", "lVelMesh_0002.uni", "other.uni", "meta.json"));
}

}  // namespace
}  // namespace liquidblend::client
