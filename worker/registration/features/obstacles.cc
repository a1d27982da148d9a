#include "worker/registration/features/obstacles.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace liquidblend::registration {
namespace {

constexpr float kNormalEdges = 4.0f;  // what a unit of a normal counts for among places
constexpr float kSameWay = 0.7f;      // cosine between the normals of a pair

// Contacts beside which the surface bends inward.
std::vector<Contact> KeepBent(const std::vector<Contact>& contacts, const ContactOptions& options) {
  const ContactNeighbors near(contacts, options.reach);
  std::vector<Contact> bent;
  for (size_t n = 0; n < contacts.size(); ++n) {
    const bool bends = near.AnyNear(static_cast<int>(n), [&](int other) {
      return IsBent(Bend::kInward, contacts[n], contacts[other], options);
    });
    if (bends) bent.push_back(contacts[n]);
  }
  return bent;
}

// Groups connected contacts, in the order of first contacts.
std::vector<Obstacle> Group(const std::vector<Contact>& contacts, float reach) {
  const ContactNeighbors near(contacts, reach);
  std::vector<char> taken(contacts.size(), 0);
  std::vector<Obstacle> obstacles;
  for (size_t first = 0; first < contacts.size(); ++first) {
    if (taken[first]) continue;
    std::vector<int> members = {static_cast<int>(first)};
    taken[first] = 1;
    for (size_t n = 0; n < members.size(); ++n) {
      near.AnyNear(members[n], [&](int other) {
        if (!std::exchange(taken[other], 1)) members.push_back(other);
        return false;
      });
    }
    std::sort(members.begin(), members.end());
    Obstacle& obstacle = obstacles.emplace_back();
    for (const int n : members) {
      obstacle.contacts.push_back(contacts[n]);
      obstacle.box.extend(contacts[n].place);
    }
  }
  return obstacles;
}

// Box and normal, in edges.
using Feature = Eigen::Matrix<float, 6, 1>;
Feature FeatureOf(const Eigen::Vector3f& place, const Eigen::Vector3f& normal) {
  return (Feature() << place, kNormalEdges * normal).finished();
}

// At the same place within another box.
Eigen::Vector3f Carry(const Eigen::Vector3f& place, const Eigen::AlignedBox3f& from,
                      const Eigen::AlignedBox3f& to) {
  const Eigen::Array3f sizes = from.sizes().array().max(1.0f);  // no thinner than an edge
  const Eigen::Array3f share = (place - from.center()).array() / sizes;
  return to.center() + (share * to.sizes().array()).matrix();
}

// Contacts that lie far from each other, the first furthest from the middle.
std::vector<int> Spread(const Obstacle& obstacle, int count) {
  std::vector<float> distances;
  for (const Contact& c : obstacle.contacts) {
    distances.push_back((c.place - obstacle.box.center()).norm());
  }
  std::vector<int> chosen;
  for (int n = 0; n < count; ++n) {
    const auto furthest = std::max_element(distances.begin(), distances.end());
    if (n > 0 && *furthest <= 1) break;  // an edge: what is left lies beside those chosen
    const Contact& next = obstacle.contacts[chosen.emplace_back(furthest - distances.begin())];
    if (n == 0) std::fill(distances.begin(), distances.end(), std::numeric_limits<float>::max());
    for (size_t k = 0; k < distances.size(); ++k) {
      const Contact& c = obstacle.contacts[k];
      const float distance =
          (FeatureOf(c.place, c.normal) - FeatureOf(next.place, next.normal)).norm();
      distances[k] = std::min(distances[k], distance);
    }
  }
  return chosen;
}

}  // namespace

std::vector<Obstacle> FindObstacles(const Surface& surface, const ObstacleOptions& options) {
  std::vector<Obstacle> obstacles = Group(
      KeepBent(FindContacts(surface, options.contacts), options.contacts), options.contacts.reach);
  std::erase_if(obstacles, [&](const Obstacle& o) {
    return static_cast<int>(o.contacts.size()) < options.min_contacts;
  });
  std::stable_sort(obstacles.begin(), obstacles.end(), [](const Obstacle& a, const Obstacle& b) {
    return a.contacts.size() > b.contacts.size();
  });
  return obstacles;
}

std::vector<ContactPair> PairContacts(const Obstacle& a, const Obstacle& b) {
  const std::vector<int> chosen = Spread(a, kMaxContactPairs);
  std::vector<ContactPair> pairs;
  for (const int n : chosen) {
    const Contact& contact = a.contacts[n];
    const Feature wanted = FeatureOf(Carry(contact.place, a.box, b.box), contact.normal);
    const auto nearest = std::min_element(
        b.contacts.begin(), b.contacts.end(), [&](const Contact& c, const Contact& d) {
          return (FeatureOf(c.place, c.normal) - wanted).squaredNorm() <
                 (FeatureOf(d.place, d.normal) - wanted).squaredNorm();
        });
    if (nearest->normal.dot(contact.normal) < kSameWay) continue;
    pairs.push_back({n, static_cast<int>(nearest - b.contacts.begin())});
  }
  if (2 * pairs.size() < chosen.size()) pairs.clear();
  return pairs;
}

}  // namespace liquidblend::registration
