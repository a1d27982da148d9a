// Obstacles: bodies that the liquid flows around, found by their edges and rounded faces, where the
// liquid's surface stays in its place and bends inward. Internal to worker/registration.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "worker/registration/features/contacts.h"

namespace liquidblend::registration {

struct Obstacle {
  std::vector<Contact> contacts;  // by place on the grid
  Eigen::AlignedBox3f box;        // of the contacts
};

struct ObstacleOptions {
  ContactOptions contacts = {};
  int min_contacts = 8;  // of an obstacle; fewer are noise
};

// Connected contacts beside each of which the surface bends inward. The largest first. Walls of a
// container and the still surface of a pool do not, nor does a wall from side to side; the corners
// of a large box are one each. Droplets carried as rigid pieces are left out.
// Cost: O(vertices log vertices) and some 900 look-ups per contact.
std::vector<Obstacle> FindObstacles(const Surface& surface, const ObstacleOptions& options = {});

// Pairs of contacts at the same place of two obstacles, as indices: some contacts of `a` that lie
// far apart from each other, at most kMaxContactPairs, each with the contact of `b` that is at the
// same place within its box and faces the same way. None if most have no such partner. Requires:
// both have contacts.
inline constexpr int kMaxContactPairs = 12;
struct ContactPair {
  int a = 0, b = 0;
};
std::vector<ContactPair> PairContacts(const Obstacle& a, const Obstacle& b);

}  // namespace liquidblend::registration
