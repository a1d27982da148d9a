#include "worker/registration/features/obstacles.h"

#include <gmock/gmock.h>

#include "tests/worker/registration/pillar_testing.h"

namespace liquidblend::registration {
namespace {

constexpr float kGround = -0.68f;  // of the pool, m

class ObstaclesTest : public ::testing::TestWithParam<bool> {
 protected:
  static mesh::SpaceTimeMesh PoolAt(double x) {
    return BuildMesh(PoolAroundPillar({.x = x, .is_round = GetParam()}));
  }
};

TEST_P(ObstaclesTest, APillarIsOneWithContactsAllAroundIt) {
  const TestSurface test(PoolAt(0.2));
  const std::vector<Obstacle> found = FindObstacles(test.surface);
  ASSERT_EQ(found.size(), 1u);
  const float edge = static_cast<float>(test.mesh.edge_length_m);
  const Eigen::AlignedBox3f& box = found[0].box;
  EXPECT_LT((edge * box.center().head<2>() - Eigen::Vector2f(0.2f, 0)).norm(), 1.5 * edge);
  for (const int axis : {0, 1}) {
    EXPECT_GT(edge * box.sizes()[axis], 2 * kPillarRadius - edge);
    EXPECT_LT(edge * box.sizes()[axis], 2 * kPillarRadius + 4 * edge) << "some ground around it";
  }
  EXPECT_GT(edge * box.sizes()[2], 0.4) << "from the ground to where waves leave it dry";
  for (const Contact& contact : found[0].contacts) {
    EXPECT_EQ(contact.first_frame, 0);
    if (edge * contact.place[2] < kGround + 0.15f) continue;
    const Eigen::Vector2f outward = edge * contact.place.head<2>() - Eigen::Vector2f(0.2f, 0);
    EXPECT_LT(contact.normal.head<2>().dot(outward.normalized()), -0.6) << "into the pillar";
  }
}

TEST_P(ObstaclesTest, ContactsArePairedWithThoseAtTheSamePlaceOfAnother) {
  const TestSurface source(PoolAt(-0.4)), target(PoolAt(0.4));
  const auto from = FindObstacles(source.surface), to = FindObstacles(target.surface);
  ASSERT_EQ(from.size(), 1u);
  ASSERT_EQ(to.size(), 1u);
  const std::vector<ContactPair> pairs = PairContacts(from[0], to[0]);
  EXPECT_EQ(pairs.size(), kMaxContactPairs);
  const Eigen::Vector3f moved(0.8f / static_cast<float>(source.mesh.edge_length_m), 0, 0);
  int num_near = 0;
  for (const auto& [a, b] : pairs) {
    const Contact &contact = from[0].contacts[a], &other = to[0].contacts[b];
    EXPECT_GT(other.normal.dot(contact.normal), 0.7);
    EXPECT_LT((other.place - contact.place - moved).norm(), 4) << contact.place.transpose();
    if ((other.place - contact.place - moved).norm() < 2) ++num_near;
  }
  EXPECT_GE(num_near, kMaxContactPairs * 3 / 4);
}

INSTANTIATE_TEST_SUITE_P(Shapes, ObstaclesTest, testing::Values(true, false),
                         [](const auto& shape) { return shape.param ? "Round" : "Square"; });

TEST(Obstacles, ThereAreNoneInAnEmptyPool) {
  const TestSurface test(BuildMesh(PoolAroundPillar({.radius = 0})));
  EXPECT_TRUE(FindObstacles(test.surface).empty());
}

TEST(Obstacles, WhatMovesIsNone) {
  const TestSurface test(BuildMesh(PoolAroundPillar({.x = -0.4, .speed = 0.06})));
  EXPECT_TRUE(FindObstacles(test.surface).empty());
}

TEST(Obstacles, OneThatFacesAnotherWayHasNoPartner) {
  Obstacle post, top;
  for (int n = 0; n < 8; ++n) {
    const float angle = 0.785f * static_cast<float>(n);
    const Eigen::Vector3f outward(std::cos(angle), std::sin(angle), 0);
    post.contacts.push_back({5 * outward, -outward, 0});
    top.contacts.push_back({5 * outward, -Eigen::Vector3f::UnitZ(), 0});
    post.box.extend(5 * outward);
    top.box.extend(5 * outward);
  }
  EXPECT_EQ(PairContacts(post, post).size(), 8u);
  for (const auto& [a, b] : PairContacts(post, post)) EXPECT_EQ(a, b);
  EXPECT_TRUE(PairContacts(post, top).empty());
}

}  // namespace
}  // namespace liquidblend::registration
