#include "worker/ingest/find_up.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/synthetic/shapes.h"
#include "tests/synthetic/turned.h"

namespace liquidblend::ingest {
namespace {

using mesh::Up;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr float kGravity = 9.81f;  // m/s^2
const parallel::Arena kArena(2);

struct FallOptions {
  Eigen::Vector3f acceleration = {0, 0, -kGravity};
  Eigen::Vector3f velocity = {0.5f, -0.2f, 1.0f};  // at frame 0
  bool has_velocities = true;
  int num_frames = 8;
};

// Two balls in free flight above a block that stays.
mesh::Animation Fall(const FallOptions& options = {}) {
  mesh::Animation animation;
  for (int k = 0; k < options.num_frames; ++k) {
    const float time_s = static_cast<float>(k) / 24;
    const Eigen::Vector3f moved =
        options.velocity * time_s + options.acceleration * time_s * time_s / 2;
    mesh::TriangleMesh parts[] = {synthetic::Box({-3, -3, -1}, {3, 3, 0}, 4),
                                  synthetic::Icosphere(Eigen::Vector3f(-1, 0, 3) + moved, 0.3, 2),
                                  synthetic::Icosphere(Eigen::Vector3f(1, 0, 4) + moved, 0.2, 2)};
    const Eigen::Vector3f velocity = options.velocity + options.acceleration * time_s;
    for (int n = 0; n < 3 && options.has_velocities; ++n) {
      parts[n].velocities = (n == 0 ? Eigen::Vector3f::Zero().eval() : velocity)
                                .replicate(1, parts[n].num_vertices());
    }
    animation.frames.push_back(synthetic::Join(parts));
  }
  return animation;
}

TEST(FindUp, IsFoundFromFallingPartsWhateverTheDirection) {
  for (int n = 1; n <= 6; ++n) {
    const Up up = static_cast<Up>(n);
    for (const bool has_velocities : {true, false}) {
      FallOptions options;
      options.has_velocities = has_velocities;
      const FoundUp found = FindUp(synthetic::Turned(Fall(options), up), kArena);
      EXPECT_EQ(mesh::NameOf(found.up), mesh::NameOf(up)) << has_velocities;
      EXPECT_EQ(found.num_samples, 2 * 6) << has_velocities;
    }
  }
}

TEST(FindUp, IsUnknownWhereNothingFallsClearly) {
  FallOptions steady;
  steady.acceleration.setZero();
  EXPECT_EQ(FindUp(Fall(steady), kArena).up, Up::kUnknown);
  steady.has_velocities = false;
  EXPECT_EQ(FindUp(Fall(steady), kArena).up, Up::kUnknown) << "rounding is no gravity";
  FallOptions slanted;
  slanted.acceleration = {kGravity, 0, -kGravity};
  EXPECT_EQ(FindUp(Fall(slanted), kArena).up, Up::kUnknown);
  FallOptions brief;
  brief.num_frames = 5;  // three accelerations of each ball
  EXPECT_EQ(FindUp(Fall(brief), kArena).up, Up::kUnknown);
  EXPECT_EQ(FindUp(mesh::Animation(), kArena).up, Up::kUnknown);
}

TEST(FindUp, IsUnknownWherePartsDisagree) {
  mesh::Animation animation = Fall();
  for (mesh::TriangleMesh& frame : animation.frames) {
    const int64_t first = frame.num_vertices() - 162;  // of the last ball
    frame.velocities.row(2).tail(frame.num_vertices() - first) *= -1;
  }
  // Turned velocities lead that ball elsewhere than its next frame.
  EXPECT_EQ(FindUp(animation, kArena).up, Up::kUnknown);
}

TEST(FindUp, TakesNoHeedOfTheMainBody) {
  mesh::Animation animation;
  for (int k = 0; k < 16; ++k) {
    const float time_s = static_cast<float>(k) / 24;
    const Eigen::Vector3f moved(kGravity * time_s * time_s / 2, 0, 0);
    const mesh::TriangleMesh parts[] = {synthetic::Icosphere(moved, 1, 2),
                                        synthetic::Icosphere({0, 5, 0}, 0.3, 2)};
    animation.frames.push_back(synthetic::Join(parts));
  }
  EXPECT_EQ(FindUp(animation, kArena).up, Up::kUnknown);
}

TEST(SettleUp, SaysWhatWasFoundAndWhatWasAssumed) {
  mesh::Animation found = synthetic::Turned(Fall(), Up::kY);
  SettleUp(found, kArena);
  EXPECT_EQ(found.up, Up::kY);
  EXPECT_THAT(found.notes,
              ElementsAre("Took y as up: falling parts show that y is up (12 accelerations)."));
  FallOptions steady;
  steady.acceleration.setZero();
  mesh::Animation assumed = Fall(steady);
  SettleUp(assumed, kArena);
  EXPECT_EQ(assumed.up, Up::kUnknown);
  EXPECT_THAT(assumed.notes, ElementsAre(HasSubstr("Assumed that z is up")));
}

TEST(SettleUp, KeepsWhatIsGivenAndSaysWhenItLooksWrong) {
  mesh::Animation right = synthetic::Turned(Fall(), Up::kY);
  right.up = Up::kY;
  SettleUp(right, kArena);
  EXPECT_THAT(right.notes, IsEmpty());
  mesh::Animation wrong = Fall();
  wrong.up = Up::kY;
  SettleUp(wrong, kArena);
  EXPECT_EQ(wrong.up, Up::kY);
  EXPECT_THAT(wrong.notes,
              ElementsAre("Took y as up, as given, although falling parts show that z is up (12 "
                          "accelerations)."));
}

}  // namespace
}  // namespace liquidblend::ingest
