#include "worker/registration/features/obstacles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/container/flat_hash_map.h"

namespace liquidblend::registration {
namespace {

constexpr float kOneWay = 0.8f;       // length of a mean of normals: less, and they disagree
constexpr float kNormalEdges = 4.0f;  // what a unit of a normal counts for among places
constexpr float kSameWay = 0.7f;      // cosine between the normals of a pair

using Box = std::array<int, 3>;

Box BoxOf(const Eigen::Vector3f& point) {
  const Eigen::Vector3i floor = point.array().floor().cast<int>();
  return {floor[0], floor[1], floor[2]};
}

// Whether the surface moves along its normal by so little; in edges per frame.
bool IsStill(const Eigen::Vector4f& normal, double max_speed) {
  return std::abs(normal[3]) <= max_speed * normal.head<3>().norm();
}

// Vertices of the surface where it hardly moves, by place.
std::vector<std::pair<Box, int32_t>> StillVertices(const Surface& surface, double max_speed) {
  std::vector<std::pair<Box, int32_t>> still;
  for (int32_t v = 0; v < surface.points.cols(); ++v) {
    if (surface.rigid[v] || surface.InFirstSlab(v) || surface.InLastSlab(v)) continue;
    if (!IsStill(surface.mesh.normals.col(v), max_speed)) continue;
    still.emplace_back(BoxOf(surface.points.col(v).head<3>()), v);
  }
  std::sort(still.begin(), still.end());
  return still;
}

// Sums over the vertices of one place.
struct Sums {
  Eigen::Vector3f points = Eigen::Vector3f::Zero();
  Eigen::Vector3f normals = Eigen::Vector3f::Zero();
  std::vector<int> frames;
  void Add(const Surface& surface, int32_t v) {
    points += surface.points.col(v).head<3>();
    normals += surface.mesh.normals.col(v).head<3>().normalized();
    frames.push_back(static_cast<int>(surface.points(3, v)));
  }
  float count() const { return static_cast<float>(frames.size()); }
  int first_frame() const { return *std::min_element(frames.begin(), frames.end()); }
  // Those that differ.
  int num_frames() const {
    std::vector<int> sorted = frames;
    std::sort(sorted.begin(), sorted.end());
    return static_cast<int>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
  }
};

// Contacts: places where the surface stays, facing the same way, for long enough.
std::vector<Contact> FindContacts(const Surface& surface, const ObstacleOptions& options) {
  const auto still = StillVertices(surface, options.max_speed);
  const double needed = std::max(1.0, options.min_share * surface.mesh.num_frames);
  std::vector<Contact> contacts;
  for (size_t begin = 0, end = 0; begin < still.size(); begin = end) {
    Sums sums;
    for (; end < still.size() && still[end].first == still[begin].first; ++end) {
      sums.Add(surface, still[end].second);
    }
    const float count = sums.count();
    if (sums.normals.norm() < kOneWay * count || sums.num_frames() < needed) continue;
    contacts.push_back({sums.points / count, sums.normals.normalized(), sums.first_frame()});
  }
  return contacts;
}

// Which contacts are near to which.
class ContactNeighbors {
 public:
  ContactNeighbors(const std::vector<Contact>& contacts, float reach)
      : contacts_(contacts), reach_(reach) {
    for (size_t n = 0; n < contacts.size(); ++n) {
      at_[BoxOf(contacts[n].place)] = static_cast<int>(n);
    }
  }
  // Whether the predicate holds of one that is near; which is then the last it is asked of.
  template <typename Predicate>
  bool AnyNear(int n, const Predicate& predicate) const {
    const Eigen::Vector3f& from = contacts_[n].place;
    const Box low = BoxOf(from.array() - reach_), high = BoxOf(from.array() + reach_);
    for (int z = low[2]; z <= high[2]; ++z) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int x = low[0]; x <= high[0]; ++x) {
          const auto found = at_.find(Box{x, y, z});
          if (found == at_.end() || found->second == n) continue;
          if ((contacts_[found->second].place - from).norm() > reach_) continue;
          if (predicate(found->second)) return true;
        }
      }
    }
    return false;
  }

 private:
  const std::vector<Contact>& contacts_;
  const float reach_;
  absl::flat_hash_map<Box, int> at_;
};

// Whether the liquid lies around both, as around a pillar, not between them, as in a corner.
bool BendsInward(const Contact& a, const Contact& b, const ObstacleOptions& options) {
  if (a.normal.dot(b.normal) > options.max_cosine) return false;
  const Eigen::Vector3f between = b.place - a.place;
  return between.dot(b.normal - a.normal) < -options.min_inward * between.norm();
}

// Contacts beside which the surface bends inward.
std::vector<Contact> KeepBent(const std::vector<Contact>& contacts,
                              const ObstacleOptions& options) {
  const ContactNeighbors near(contacts, options.reach);
  std::vector<Contact> bent;
  for (size_t n = 0; n < contacts.size(); ++n) {
    const bool bends = near.AnyNear(static_cast<int>(n), [&](int other) {
      return BendsInward(contacts[n], contacts[other], options);
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
  std::vector<Obstacle> obstacles =
      Group(KeepBent(FindContacts(surface, options), options), options.reach);
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
