// A registration that was interrupted anywhere and goes on from its checkpoint comes to the same
// bytes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <variant>

#include "core/store/files/files.h"
#include "tests/core/store/store_testing.h"
#include "tests/synthetic/implicit.h"
#include "worker/jobs/assemble_family.h"
#include "worker/jobs/checkpoint_file.h"
#include "worker/jobs/register_meshes.h"

namespace liquidblend::jobs::resume_test {
namespace {

using registration::IterationState;
using registration::Registration;
using registration::RegistrationState;
using registration::SharpenState;
using store::MemoryBlob;
using store::MemoryWriter;
using store::Succeeds;
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

  // Interrupts it after each step. Returns the states there.
  std::vector<RegistrationState> ExpectSameBytesFromAnyState(const Task& task) {
    std::vector<RegistrationState> states;
    const auto whole = Register(
        task, {.keep = [&](RegistrationState state) { states.push_back(std::move(state)); }});
    EXPECT_THAT(whole, Succeeds());
    const std::string expected = TargetBytes(*whole);
    EXPECT_EQ(TargetBytes(*Register(task, {}, 1)), expected) << "without any state kept";
    for (size_t n = 0; n < states.size(); ++n) {
      const RegistrationState resumed = WrittenAndRead(states[n]);
      size_t num_kept = 0;
      const auto result =
          Register(task, {.keep = [&](const auto&) { ++num_kept; }, .resume = &resumed});
      EXPECT_THAT(result, Succeeds());
      EXPECT_EQ(TargetBytes(*result), expected) << "from state " << n;
      EXPECT_EQ(num_kept, states.size() - n - 1) << "what was done is not done again";
      EXPECT_GE(result->report.seconds, std::visit([](auto& s) { return s.seconds; }, resumed));
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
