// Contacts: where the liquid's surface stays in its place, at walls, at the floor and at obstacles.
// Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// The liquid's surface within one cell of a grid of mean edge lengths, where it stays.
struct Contact {
  Eigen::Vector3f place = Eigen::Vector3f::Zero();   // mean of its vertices; registration units
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit length, into the body
  int first_frame = 0;
};

struct ContactOptions {
  double max_speed = 0.1;   // >= 0; edges per frame, along the normal
  double min_share = 0.75;  // [0, 1]; of the frames, in which a contact is there
  float reach = 4.0f;       // > 0; edges; contacts so near to each other are compared
  float max_cosine = 0.7f;  // between normals where the surface bends, 45 degrees ...
  float min_bend = 0.5f;    // ... inward, by how much nearer their tips are than their feet, per
                            // distance of the feet; outward, by how much further
};

// Cell of the grid that contacts are found on.
using ContactCell = std::array<int, 3>;
ContactCell CellOf(const Eigen::Vector3f& point);

// Vertices where the surface hardly moves, by cell. Those of rigid pieces and of the end slabs are
// left out.
std::vector<std::pair<ContactCell, int32_t>> StillVertices(const Surface& surface,
                                                           double max_speed);

// Places where the surface stays, facing the same way, for long enough; by cell.
// Cost: O(vertices log vertices).
std::vector<Contact> FindContacts(const Surface& surface, const ContactOptions& options = {});

// Whether the surface bends between two contacts: inward, as around a pillar, or outward, as in a
// corner of the container.
enum class Bend { kInward, kOutward };
bool IsBent(Bend bend, const Contact& a, const Contact& b, const ContactOptions& options);

// Which contacts are near to which. The contacts must outlive it.
class ContactNeighbors {
 public:
  ContactNeighbors(const std::vector<Contact>& contacts, float reach);
  // Whether the predicate holds of one that is near; which is then the last it is asked of.
  // Cost: some 900 look-ups at a reach of 4.
  template <typename Predicate>
  bool AnyNear(int n, const Predicate& predicate) const {
    const Eigen::Vector3f& from = contacts_[n].place;
    const ContactCell low = CellOf(from.array() - reach_), high = CellOf(from.array() + reach_);
    for (int z = low[2]; z <= high[2]; ++z) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int x = low[0]; x <= high[0]; ++x) {
          const auto found = at_.find(ContactCell{x, y, z});
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
  absl::flat_hash_map<ContactCell, int> at_;
};

}  // namespace liquidblend::registration
