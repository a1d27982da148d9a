// Obstacles: bodies that the liquid flows around, found by their edges and rounded faces, where the
// liquid's surface stays in its place and bends inward. Internal to worker/registration.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// The liquid's surface within one cell of a grid of mean edge lengths, where it stays.
struct Contact {
  Eigen::Vector3f place = Eigen::Vector3f::Zero();   // mean of its vertices; registration units
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit length, into the body
  int first_frame = 0;
};

struct Obstacle {
  std::vector<Contact> contacts;  // by place on the grid
  Eigen::AlignedBox3f box;        // of the contacts
};

struct ObstacleOptions {
  double max_speed = 0.1;   // >= 0; edges per frame, along the normal
  double min_share = 0.75;  // [0, 1]; of the frames, in which a contact is there
  float reach = 4.0f;       // > 0; edges; contacts so near to each other are compared
  float max_cosine = 0.7f;  // between normals where the surface bends, 45 degrees ...
  float min_inward = 0.5f;  // ... inward, by how much nearer their tips are than their feet, per
                            // distance of the feet
  int min_contacts = 8;     // of an obstacle; fewer are noise
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
