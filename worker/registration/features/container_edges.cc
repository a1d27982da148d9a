#include "worker/registration/features/container_edges.h"

#include <algorithm>

#include "absl/container/flat_hash_map.h"

namespace liquidblend::registration {
namespace {

// A contact at an edge, with the normals of the walls that meet there, its own first.
struct EdgeContact {
  Contact contact;
  std::vector<Eigen::Vector3f> walls;
};

bool IsAmong(const Eigen::Vector3f& normal, const std::vector<Eigen::Vector3f>& walls,
             float min_cosine) {
  return std::any_of(walls.begin(), walls.end(),
                     [&](const Eigen::Vector3f& wall) { return wall.dot(normal) >= min_cosine; });
}

// Normals of a wall near an edge, summed up, so that their order does not matter.
struct Wall {
  Eigen::Vector3f first;
  Eigen::Vector3f sum;
};

void AddNormal(const Eigen::Vector3f& normal, float same_way, std::vector<Wall>& walls) {
  for (Wall& wall : walls) {
    if (wall.first.dot(normal) < same_way) continue;
    wall.sum += normal;
    return;
  }
  walls.push_back({normal, normal});
}

// Contacts beside which the surface bends outward.
std::vector<EdgeContact> FindEdgeContacts(const Surface& surface,
                                          const ContainerEdgeOptions& options) {
  const std::vector<Contact> contacts = FindContacts(surface, options.contacts);
  const ContactNeighbors near(contacts, options.contacts.reach);
  std::vector<EdgeContact> edges;
  for (size_t n = 0; n < contacts.size(); ++n) {
    std::vector<Wall> walls = {{contacts[n].normal, contacts[n].normal}};
    near.AnyNear(static_cast<int>(n), [&](int other) {
      if (IsBent(Bend::kOutward, contacts[n], contacts[other], options.contacts)) {
        AddNormal(contacts[other].normal, options.same_way, walls);
      }
      return false;
    });
    if (walls.size() < 2) continue;
    EdgeContact& edge = edges.emplace_back();
    edge.contact = contacts[n];
    for (const Wall& wall : walls) edge.walls.push_back(wall.sum.normalized());
  }
  return edges;
}

// Projection on the directions of the normals.
Eigen::Matrix3f ProjectionOn(const std::vector<Eigen::Vector3f>& normals) {
  Eigen::Matrix3f projection = Eigen::Matrix3f::Zero();
  for (const Eigen::Vector3f& normal : normals) {
    const Eigen::Vector3f rest = normal - projection * normal;
    const float length = rest.norm();
    if (length > 0.1f) projection += rest * rest.transpose() / (length * length);
  }
  return projection;
}

// Walls of an edge that the other animation has at the same place.
std::vector<Eigen::Vector3f> SharedWalls(const EdgeContact& edge,
                                         const std::vector<EdgeContact>& others,
                                         const ContainerEdgeOptions& options) {
  const EdgeContact* nearest = nullptr;
  float least = options.same_place;
  for (const EdgeContact& other : others) {
    const float distance = (other.contact.place - edge.contact.place).norm();
    if (distance > least || other.contact.normal.dot(edge.contact.normal) < options.same_way) {
      continue;
    }
    least = distance;
    nearest = &other;
  }
  std::vector<Eigen::Vector3f> shared;
  if (nearest == nullptr) return shared;
  for (const Eigen::Vector3f& wall : edge.walls) {
    if (IsAmong(wall, nearest->walls, options.same_way)) shared.push_back(wall);
  }
  return shared;
}

bool IsNearUsers(const Eigen::Vector3f& point, const std::vector<Correspondence>& users,
                 double edge_length_m, float reach) {
  return std::any_of(users.begin(), users.end(), [&](const Correspondence& user) {
    const Eigen::Vector3f place = (user.source.head<3>() / edge_length_m).cast<float>();
    return (place - point).norm() < reach;
  });
}

}  // namespace

HeldVertices FindContainerEdges(const Surface& source, const Surface& target,
                                const std::vector<Correspondence>& users, double edge_length_m,
                                const ContainerEdgeOptions& options) {
  struct Held {
    Eigen::Vector3f normal;
    Eigen::Matrix3f projection;
  };
  const std::vector<EdgeContact> of_target = FindEdgeContacts(target, options);
  absl::flat_hash_map<ContactCell, Held> cells;
  for (const EdgeContact& edge : FindEdgeContacts(source, options)) {
    const auto walls = SharedWalls(edge, of_target, options);
    if (walls.size() < 2) continue;
    cells.emplace(CellOf(edge.contact.place), Held{edge.contact.normal, ProjectionOn(walls)});
  }
  HeldVertices held;
  if (cells.empty()) return held;
  for (const auto& [cell, v] : StillVertices(source, options.contacts.max_speed)) {
    const auto found = cells.find(cell);
    if (found == cells.end()) continue;
    const Eigen::Vector3f normal = source.mesh.normals.col(v).head<3>().normalized();
    if (normal.dot(found->second.normal) < options.same_way) continue;
    const Eigen::Vector3f point = source.points.col(v).head<3>();
    if (IsNearUsers(point, users, edge_length_m, options.near_users)) continue;
    held.emplace(v, found->second.projection);
  }
  return held;
}

}  // namespace liquidblend::registration
