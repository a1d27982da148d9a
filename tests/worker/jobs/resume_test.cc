// A registration that was interrupted anywhere and goes on from its checkpoint comes to the same
// bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/store/files/files.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/implicit.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/checkpoint_file.h"
#include "worker/jobs/register_meshes.h"

namespace liquidblend::jobs::resume_test {
namespace {

using registration::CompetitionState;
using registration::IterationState;
using registration::Registration;
using registration::RegistrationState;
using registration::SharpenState;
using store::MemoryBlob;
using store::MemoryWriter;
using store::Succeeds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A drop that falls into a pool from a height.
mesh::Animation Drop(float height_m) {
  synthetic::FallingDropOptions options;
  options.drop_m[2] = height_m;
  options.spacing_m = 0.1;
  options.num_frames = 5;
  return synthetic::FallingDrop(options);
}

// A drop above a long pool, this far to the right.
mesh::Animation DropAbovePool(double x_m) {
  synthetic::FallingDropsOptions options;
  options.drops = {{.centre_m = {x_m, 0, 0.8}}};
  options.pool_half_width_m = {1.6, 0.4};
  options.num_frames = 4;
  return synthetic::FallingDrops(options);
}

RegisterMeshesOptions Options(double coarse_vertices) {
  RegisterMeshesOptions options;
  options.build.connectivity = spacetime::Connectivity::kRebuilt;
  options.build.droplet_vertices = 0;
  options.registration.max_iterations = 4;
  options.registration.refine_iterations = 3;
  options.registration.sample_share = 0.2;
  options.registration.coarse_vertices = coarse_vertices;
  return options;
}

// What goes into the store, but for the time that it took.
std::string TargetBytes(const Registration& registration) {
  RegisteredTarget target;
  target.name = "high";
  target.registration = registration;
  target.registration.report.seconds = 0.0;
  store::TargetFile file;
  file.target = ViewOf(target);
  MemoryWriter writer;
  EXPECT_THAT(store::WriteTarget(file, writer), Succeeds());
  return writer.content;
}

// As another worker gets it.
RegistrationState WrittenAndRead(const RegistrationState& state) {
  MemoryWriter writer;
  EXPECT_THAT(WriteCheckpoint({"fingerprint", "lease", 1}, state, writer), Succeeds());
  const MemoryBlob blob(writer.content);
  auto checkpoint = ReadCheckpoint(blob, "checkpoint");
  EXPECT_THAT(checkpoint, Succeeds());
  return std::move(checkpoint->state);
}

// Worked so far, but for a state of other pairings.
double SecondsOf(const RegistrationState& state) {
  if (const auto* const finer = std::get_if<SharpenState>(&state)) return finer->seconds;
  const auto* const iterations = std::get_if<IterationState>(&state);
  return iterations == nullptr ? 0.0 : iterations->seconds;
}

class ResumeTest : public ::testing::Test {
 protected:
  explicit ResumeTest(mesh::Animation low = Drop(0.45f), mesh::Animation high = Drop(0.65f))
      : low_(std::move(low)), high_(std::move(high)) {}

  struct Task {
    RegisterMeshesOptions options;
    std::vector<registration::Correspondence> correspondences = {};
    const registration::PreviousRegistration* previous = nullptr;
  };

  absl::StatusOr<Registration> Register(const Task& task,
                                        const registration::RegistrationHooks& hooks,
                                        int num_threads = 2) {
    const auto read = [this](const mesh::Animation& animation) {
      return [this, &animation] {
        ++num_reads_;
        return animation;
      };
    };
    return RegisterMeshes({source_, read(low_)}, {target_, read(high_)}, task.correspondences,
                          task.previous, task.options, parallel::Arena(num_threads), hooks);
  }

  // Interrupts it after each step, or each of some. Returns the states after all.
  std::vector<RegistrationState> ExpectSameBytesFromAnyState(
      const Task& task, const std::function<bool(size_t)>& is_one = [](size_t) { return true; }) {
    std::vector<RegistrationState> states;
    const auto whole = Register(
        task, {.keep = [&](RegistrationState state) { states.push_back(std::move(state)); }});
    EXPECT_THAT(whole, Succeeds());
    const std::string expected = TargetBytes(*whole);
    EXPECT_EQ(TargetBytes(*Register(task, {}, 1)), expected) << "without any state kept";
    for (size_t n = 0; n < states.size(); ++n) {
      if (!is_one(n)) continue;
      const RegistrationState resumed = WrittenAndRead(states[n]);
      size_t num_kept = 0;
      const auto result =
          Register(task, {.keep = [&](const auto&) { ++num_kept; }, .resume = &resumed});
      EXPECT_THAT(result, Succeeds());
      EXPECT_EQ(TargetBytes(*result), expected) << "from state " << n;
      EXPECT_EQ(num_kept, states.size() - n - 1) << "what was done is not done again";
      if (result->report.hypotheses.empty()) {
        EXPECT_GE(result->report.seconds, SecondsOf(resumed));
      }
    }
    return states;
  }

  // The tops of the drops at frame 2.
  registration::Correspondence Tops(bool hard) const {
    registration::Correspondence top;
    top.hard = hard;
    top.source = TopOf(source_);
    top.target = TopOf(target_);
    return top;
  }

  static mesh::SpaceTimeMesh Build(const mesh::Animation& animation) {
    return *spacetime::Build(animation, Options(1e6).build, parallel::Arena(2));
  }

  const mesh::Animation low_, high_;
  const mesh::SpaceTimeMesh source_ = Build(low_), target_ = Build(high_);
  std::atomic<int> num_reads_ = 0;  // meshes are read in parallel

 private:
  static Eigen::Vector4d TopOf(const mesh::SpaceTimeMesh& mesh) {
    Eigen::Index top = 0;
    mesh.vertices.row(2).maxCoeff(&top);
    Eigen::Vector4d place = mesh.vertices.col(top).cast<double>();
    place[3] = std::max(0.0, place[3]);  // in frames; an end slab's vertex lies before the first
    return place;
  }
};

TEST_F(ResumeTest, WithAutomaticCorrespondences) {
  const Task task = {Options(1e6)};
  const auto states = ExpectSameBytesFromAnyState(task);
  EXPECT_EQ(states.size(), 4u);
  const auto whole = Register(task, {});
  ASSERT_FALSE(whole->report.correspondences.empty());
  EXPECT_TRUE(whole->report.correspondences[0].automatic);
}

TEST_F(ResumeTest, WithHardAndSoftCorrespondencesOfTheUser) {
  registration::Correspondence bottom;
  bottom.source = bottom.target = {0.5, 0.5, 0, 3};
  ExpectSameBytesFromAnyState({Options(1e6), {Tops(/*hard=*/true), bottom}});
}

TEST_F(ResumeTest, ARefinement) {
  const auto first = Register({Options(1e6)}, {});
  ASSERT_THAT(first, Succeeds());
  const std::vector<registration::Correspondence> none;
  const registration::PreviousRegistration previous{first->displacement, none};
  const auto states =
      ExpectSameBytesFromAnyState({Options(1e6), {Tops(/*hard=*/false)}, &previous});
  EXPECT_EQ(states.size(), 3u);
}

class ResumeFinerNodesTest : public ResumeTest {
 protected:
  ResumeFinerNodesTest() : ResumeTest(DropAbovePool(0.0), DropAbovePool(0.5)) {}
};

TEST_F(ResumeFinerNodesTest, CoarseToFine) {
  Task task = {Options(static_cast<double>(source_.num_vertices()) / 8), {Tops(/*hard=*/true)}};
  task.options.registration.max_iterations = 2;  // so that something is left apart
  task.options.registration.automatic_correspondences = false;
  task.options.registration.finer_from_edges = 0.04;
  const auto states = ExpectSameBytesFromAnyState(task);
  ASSERT_GE(states.size(), 5u) << "two iterations, carried over, and rounds of finer nodes";
  EXPECT_EQ(std::get<IterationState>(states[1]).last.iteration, 2);
  EXPECT_EQ(std::get<SharpenState>(states[2]).num_rounds, 0);
  EXPECT_EQ(std::get<SharpenState>(states[4]).num_rounds, 2);
  EXPECT_GT(std::get<SharpenState>(states[4]).num_finer_nodes, 0);

  num_reads_ = 0;
  ASSERT_THAT(Register(task, {.resume = &states[2]}), Succeeds());
  EXPECT_EQ(num_reads_, 0) << "coarse meshes are made for nothing";
}

// A drop that falls elsewhere. Without pairs of features it grabs the pool, so that they win.
class ResumeCompetitionTest : public ResumeTest {
 protected:
  ResumeCompetitionTest() : ResumeTest(DropAbovePool(-0.6), DropAbovePool(0.6)) {}

  static Task TaskWith(double coarse_vertices, registration::Pairing pairing) {
    Task task = {Options(coarse_vertices)};
    task.options.registration.max_iterations = 8;
    task.options.registration.pairing = pairing;
    return task;
  }
  // Iterations of the pairing that this state tries, and how many are done.
  static std::string Describe(const RegistrationState& state) {
    const auto* const iterations = std::get_if<IterationState>(&state);
    if (iterations != nullptr) return absl::StrCat("first ", iterations->last.iteration);
    const auto* const competition = std::get_if<CompetitionState>(&state);
    if (competition == nullptr) return "finer";
    const int next = competition->next ? competition->next->last.iteration : 0;
    return absl::StrCat(competition->tried.size(), " tried, next ", next);
  }
  static std::vector<std::string> Describe(const std::vector<RegistrationState>& states) {
    std::vector<std::string> descriptions;
    for (const RegistrationState& state : states) descriptions.push_back(Describe(state));
    return descriptions;
  }
};

TEST_F(ResumeCompetitionTest, TheOtherPairingWins) {
  const Task task = TaskWith(1e6, registration::Pairing::kNone);
  const auto is_one = [](size_t n) { return n % 3 == 2 || n == 7 || n == 8; };
  const auto states = ExpectSameBytesFromAnyState(task, is_one);
  EXPECT_THAT(
      Describe(states),
      ElementsAre("first 1", "first 2", "first 3", "first 4", "first 5", "first 6", "first 7",
                  "first 8", "1 tried, next 0", "1 tried, next 1", "1 tried, next 2",
                  "1 tried, next 3", "1 tried, next 4", "1 tried, next 5", "1 tried, next 6",
                  "1 tried, next 7", "1 tried, next 8", "2 tried, next 0"));
  const auto whole = Register(task, {});
  ASSERT_EQ(whole->report.hypotheses.size(), 2u);
  EXPECT_TRUE(whole->report.hypotheses[1].is_kept);
}

TEST_F(ResumeCompetitionTest, OnCoarseMeshes) {
  const double coarse_vertices = static_cast<double>(source_.num_vertices()) / 4;
  const Task task = TaskWith(coarse_vertices, registration::Pairing::kNone);
  const auto is_one = [](size_t n) { return n == 8 || n == 12 || n == 17; };
  const std::vector<std::string> states = Describe(ExpectSameBytesFromAnyState(task, is_one));
  ASSERT_GT(states.size(), 18u);
  EXPECT_EQ(states[8], "1 tried, next 0");
  EXPECT_EQ(states[17], "2 tried, next 0");
  EXPECT_EQ(states[18], "finer");
}

TEST_F(ResumeCompetitionTest, RefusesAStateOfAnotherCompetition) {
  const Task task = TaskWith(1e6, registration::Pairing::kNone);
  CompetitionState state;
  const auto keep = [&](RegistrationState kept) {
    const auto* const competition = std::get_if<CompetitionState>(&kept);
    if (competition != nullptr && competition->next) state = *competition;
    return true;
  };
  ASSERT_THAT(Register(task, {.keep = keep}), Succeeds());
  ASSERT_TRUE(state.next.has_value());
  const auto message = [&](const std::function<void(CompetitionState&)>& change,
                           registration::Pairing pairing = registration::Pairing::kNone) {
    CompetitionState changed = state;
    change(changed);
    const RegistrationState resumed = changed;
    const absl::Status status = Register(TaskWith(1e6, pairing), {.resume = &resumed}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    return std::string(status.message());
  };
  EXPECT_THAT(message([](auto& s) { s.tried[0].pairing = "by another program"; }),
              HasSubstr("not those of this registration"));
  EXPECT_THAT(message([](auto& s) { s.num_others = 2; }), HasSubstr("2 of them others"));
  EXPECT_THAT(message([](auto& s) { s.num_others = -1; }), HasSubstr("-1 of them others"));
  EXPECT_THAT(message([](auto& s) { s.tried.clear(); }), HasSubstr("has tried 0 pairings"));
  EXPECT_THAT(message([](auto& s) { s.tried.push_back(s.tried[0]); }), HasSubstr("tried 2"));
  EXPECT_THAT(message([](auto& s) { s.best.last.num_iterations = 7; }), HasSubstr("tried 1"));
  EXPECT_THAT(message([](auto&) {}, registration::Pairing::kFound), HasSubstr("tried 1"));
  EXPECT_THAT(message([](auto& s) { s.next->maps.pop_back(); }), HasSubstr("deformation nodes"));
  EXPECT_THAT(message([](auto& s) {
                s.next.reset();
                s.num_others = 1;  // that one cannot be registered
                s.best.maps.pop_back();
              }),
              HasSubstr("deformation nodes"));
}

TEST_F(ResumeTest, ARefinementCoarseToFine) {
  const auto first = Register({Options(1000)}, {});
  ASSERT_THAT(first, Succeeds());
  const std::vector<registration::Correspondence> none;
  const registration::PreviousRegistration previous{first->displacement, none};
  ExpectSameBytesFromAnyState({Options(1000), {Tops(/*hard=*/false)}, &previous});
}

TEST_F(ResumeTest, CancelledFromProgressLeavesTheStateOfThatIteration) {
  RegistrationState last;
  const auto cancelled =
      Register({Options(1e6)}, {.progress = [](const auto& report) { return report.iteration < 2; },
                                .keep = [&](RegistrationState state) { last = std::move(state); }});
  EXPECT_EQ(cancelled.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(std::get<IterationState>(last).last.iteration, 2);
}

TEST_F(ResumeTest, RefusesAStateOfAnotherRegistration) {
  std::vector<RegistrationState> states;
  const auto keep = [&](RegistrationState state) { states.push_back(std::move(state)); };
  ASSERT_THAT(Register({Options(1000)}, {.keep = keep}), Succeeds());
  const auto message = [&](const RegistrationState& state, double coarse_vertices) {
    const absl::Status status = Register({Options(coarse_vertices)}, {.resume = &state}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    return std::string(status.message());
  };
  EXPECT_THAT(message(states[1], 1e6), HasSubstr("deformation nodes, and there are"));
  EXPECT_THAT(message(states[4], 1e6), HasSubstr("registered at once"));
  const auto changed = [&](const std::function<void(IterationState&)>& change) {
    IterationState state = std::get<IterationState>(states[1]);
    change(state);
    return message(state, 1000);
  };
  EXPECT_THAT(changed([](auto& state) { state.last.num_iterations = 9; }),
              HasSubstr("after iteration 2 of 9, and these are 4"));
  EXPECT_THAT(changed([](auto& state) { state.last.iteration = 0; }), HasSubstr("iteration 0"));
  EXPECT_THAT(changed([](auto& state) { state.maps[3][7] = std::nanf(""); }),
              HasSubstr("not finite at deformation node 3"));
  EXPECT_THAT(changed([](auto& state) { state.draws.pop_back(); }), HasSubstr("samples of 1"));
  EXPECT_THAT(changed([](auto& state) { state.draws[0].num_target = 1 << 30; }),
              HasSubstr("and 1073741824 samples"));
  EXPECT_THAT(changed([](auto& state) { state.worst[0] = -1; }), HasSubstr("vertex -1"));
  SharpenState finer = std::get<SharpenState>(states[4]);
  finer.displacement.conservativeResize(4, 7);
  EXPECT_THAT(message(finer, 1000), HasSubstr("of 7 vertices"));
}

}  // namespace
}  // namespace liquidblend::jobs::resume_test
