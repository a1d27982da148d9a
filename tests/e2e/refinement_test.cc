// What a refinement costs and is worth: two_drops A to B, with user correspondences from scratch
// and added to a registration without. Distances are mean symmetric point-to-surface distances in
// mean edge lengths, over every third frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "core/slice/slice.h"
#include "tests/e2e/two_drops.h"
#include "tests/synthetic/slice_family.h"
#include "tests/synthetic/surface_distance.h"
#include "worker/registration/register.h"
#include "worker/spacetime/build.h"

namespace liquidblend {
namespace {

using registration::Correspondence;
using registration::Registration;

constexpr int kFrameStep = 3;

mesh::SpaceTimeMesh BuildMesh(const mesh::Animation& animation, const parallel::Arena& arena) {
  auto mesh = spacetime::Build(animation, {}, arena);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return *std::move(mesh);
}

// The tops and bottoms of both drops in the first frame, and their tops when they strike.
std::vector<Correspondence> Events(bool hard) {
  constexpr double kScale = 4.4;  // metres per unit of the simulation, in which they were picked
  const double left = -0.223, right = 0.223;
  const auto pair = [&](double x, double z_source, double frame_source, double z_target,
                        double frame_target) {
    Correspondence c;
    c.hard = hard;
    c.source = {kScale * x, 0, kScale * z_source, frame_source};
    c.target = {kScale * x, 0, kScale * z_target, frame_target};
    return c;
  };
  return {pair(left, 0.095, 0, 0.354, 0),  pair(left, -0.09, 0, 0.16, 0),
          pair(right, 0.354, 0, 0.095, 0), pair(right, 0.16, 0, -0.09, 0),
          pair(left, 0.014, 6, 0.0, 13),   pair(right, 0.0, 13, 0.014, 6)};
}

// What the process spends on its cores while this lives.
class CoreSeconds {
 public:
  explicit CoreSeconds(double& seconds) : seconds_(seconds) {}
  ~CoreSeconds() { seconds_ = static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  double& seconds_;
  const std::clock_t start_ = std::clock();
};

class RefinementTest : public ::testing::Test {
 protected:
  // At weight w against a simulation.
  double Distance(const Registration& registration, double weight,
                  const mesh::Animation& truth) const {
    mesh::RegisteredFamily family = mesh::ViewOf(source_);
    mesh::FamilyTarget target;
    target.displacement = {reinterpret_cast<const mesh::Float4*>(registration.displacement.data()),
                           static_cast<size_t>(registration.displacement.cols())};
    family.targets = {target};
    family.domain_min = {-9, -9, -9};
    family.domain_max = {9, 9, 9};
    const slice::CellIndex index(family);
    const int count = (family.num_frames - 1) / kFrameStep;
    const double sum = arena_.Sum(count, [&](int64_t n) {
      const int64_t frame = n * kFrameStep;
      const double time_s = static_cast<double>(frame) / family.frames_per_second;
      return synthetic::MeanSymmetricDistance(
          synthetic::SliceFamily(index, std::vector{weight}, time_s), truth.frames[frame]);
    });
    return sum / count / family.edge_length_m;
  }
  void Print(const char* name, const Registration& registration) const {
    int num_kept = 0;
    for (const auto& report : registration.report.correspondences) num_kept += report.kept;
    std::printf(
        "%-24s %5.1f s %5.1f core s %3d iterations  weight 1: %.4f  weight 0.5: %.4f  %d of %d "
        "kept\n",
        name, registration.report.seconds, core_seconds_, registration.report.num_iterations,
        Distance(registration, 1.0, b_), Distance(registration, 0.5, mid_), num_kept,
        static_cast<int>(registration.report.correspondences.size()));
  }
  Registration FromScratch(const std::vector<Correspondence>& list) {
    const CoreSeconds watch(core_seconds_);
    auto result = registration::Register(source_, target_, list, options_, arena_);
    EXPECT_TRUE(result.ok()) << result.status();
    return *std::move(result);
  }
  Registration Refined(const Registration& previous, const std::vector<Correspondence>& before,
                       const std::vector<Correspondence>& now) {
    const CoreSeconds watch(core_seconds_);
    auto result = registration::Refine(source_, target_, now, {previous.displacement, before},
                                       options_, arena_);
    EXPECT_TRUE(result.ok()) << result.status();
    return *std::move(result);
  }

  const registration::RegistrationOptions options_ = [] {
    registration::RegistrationOptions options;
    options.automatic_correspondences = false;
    return options;
  }();
  parallel::Arena arena_;
  double core_seconds_ = 0;  // of the last registration
  mesh::Animation a_ = e2e::LoadTwoDrops("A", arena_), b_ = e2e::LoadTwoDrops("B", arena_),
                  mid_ = e2e::LoadTwoDrops("MID", arena_);
  mesh::SpaceTimeMesh source_ = BuildMesh(a_, arena_), target_ = BuildMesh(b_, arena_);
};

TEST_F(RefinementTest, CostsLessThanFromScratchAndIsAsGood) {
  const Registration none = FromScratch({});
  Print("no correspondences", none);
  for (const bool hard : {true, false}) {
    const std::vector<Correspondence> events = Events(hard);
    const Registration scratch = FromScratch(events);
    Print(hard ? "6 hard, from scratch" : "6 soft, from scratch", scratch);
    const double scratch_core_seconds = core_seconds_;
    const Registration refined = Refined(none, {}, events);
    Print(hard ? "6 hard, refined" : "6 soft, refined", refined);
    EXPECT_LT(core_seconds_, scratch_core_seconds);
    EXPECT_LT(Distance(refined, 1.0, b_), 1.1 * Distance(scratch, 1.0, b_));
    if (!hard) continue;
    for (const Registration* result : {&scratch, &refined}) {
      for (const auto& report : result->report.correspondences) {
        EXPECT_TRUE(report.kept);
        EXPECT_LT(report.residual_m, 1e-3 * source_.edge_length_m);
        EXPECT_LT(report.residual_frames, 1e-3);
      }
    }
    const Registration back = Refined(scratch, events, {});
    Print("6 hard, removed again", back);
    EXPECT_LT(Distance(back, 1.0, b_), 1.1 * Distance(none, 1.0, b_));
  }
}

}  // namespace
}  // namespace liquidblend
