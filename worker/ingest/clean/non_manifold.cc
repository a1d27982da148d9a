#include "worker/ingest/clean/non_manifold.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/str_cat.h"

namespace liquidblend::ingest {
namespace {

using Eigen::Vector3d;

constexpr double kSameAngle = 1e-5;  // rounding of positions turns triangles by about a tenth of it

// A triangle seen along an edge, from its lower vertex to its higher one.
struct Spoke {
  double angle;  // counter-clockwise
  bool opens;    // liquid is on the side of larger angles
  int32_t side;
};

std::vector<Spoke> FindSpokes(const mesh::TriangleMesh& mesh, std::span<const int32_t> sides) {
  const auto corner = [&](int32_t side, int k) {
    return mesh.triangles((side % 3 + k) % 3, side / 3);
  };
  const auto position = [&](int v) -> Vector3d { return mesh.vertices.col(v).cast<double>(); };
  const int low = std::min(corner(sides[0], 0), corner(sides[0], 1));
  const int high = std::max(corner(sides[0], 0), corner(sides[0], 1));
  const Vector3d axis = (position(high) - position(low)).stableNormalized();
  const Vector3d x = axis.isZero() ? Vector3d::UnitX() : axis.unitOrthogonal();
  const Vector3d y = axis.cross(x);
  std::vector<Spoke> spokes;
  for (const int32_t side : sides) {
    const Vector3d arm = position(corner(side, 2)) - position(low);
    // A triangle's normal, outward, turns its arm counter-clockwise if it runs upward.
    spokes.push_back({std::atan2(arm.dot(y), arm.dot(x)), corner(side, 0) != low, side});
  }
  return spokes;
}

// Puts the spokes in the order of their angles, from the end of the widest gap on, so that none
// that lie on one another are apart; of those, the ones that close come first.
void SortAround(std::vector<Spoke>& spokes) {
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) {
    return a.angle != b.angle ? a.angle < b.angle : a.side < b.side;
  });
  auto start = spokes.begin();
  double widest = spokes.front().angle + 2 * std::numbers::pi - spokes.back().angle;
  for (auto spoke = spokes.begin() + 1; spoke != spokes.end(); ++spoke) {
    const double gap = spoke->angle - (spoke - 1)->angle;
    if (gap <= widest) continue;
    widest = gap;
    start = spoke;
  }
  std::rotate(spokes.begin(), start, spokes.end());
  for (auto begin = spokes.begin(), end = begin; begin != spokes.end(); begin = end) {
    do {
      ++end;
    } while (end != spokes.end() && std::abs(end->angle - (end - 1)->angle) < kSameAngle);
    std::stable_partition(begin, end, [](const Spoke& spoke) { return !spoke.opens; });
  }
}

struct Cut {
  int32_t side;    // 3 * triangle + side
  int32_t vertex;  // half-way
  bool operator<(const Cut& other) const { return side < other.side; }
};

// The sides that are cut, both of each edge, ascending; appends the vertices.
std::vector<Cut> CutSides(const Neighbours& neighbours, std::span<const int32_t> sides,
                          mesh::TriangleMesh& mesh) {
  auto vertex = static_cast<int32_t>(mesh.num_vertices());
  const auto num_after = static_cast<int64_t>(mesh.num_vertices() + std::ssize(sides));
  const bool has_velocities = mesh.velocities.cols() > 0;
  mesh.vertices.conservativeResize(3, num_after);
  if (has_velocities) mesh.velocities.conservativeResize(3, num_after);
  std::vector<Cut> cuts;
  cuts.reserve(2 * sides.size());
  for (const int32_t side : sides) {
    const int a = mesh.triangles(side % 3, side / 3);
    const int b = mesh.triangles((side + 1) % 3, side / 3);
    const int32_t across = neighbours[side / 3][side % 3];
    const int across_side = mesh.triangles(0, across) == b   ? 0
                            : mesh.triangles(1, across) == b ? 1
                                                             : 2;
    cuts.push_back({side, vertex});
    cuts.push_back({3 * across + across_side, vertex});
    mesh.vertices.col(vertex) = 0.5f * (mesh.vertices.col(a) + mesh.vertices.col(b));
    if (has_velocities) {
      mesh.velocities.col(vertex) = 0.5f * (mesh.velocities.col(a) + mesh.velocities.col(b));
    }
    ++vertex;
  }
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

// The parts of a triangle whose sides have these vertices half-way, or -1; one at least.
std::vector<Eigen::Vector3i> Parts(const Eigen::Vector3i& corners, const std::array<int, 3>& half) {
  int first = 0;
  while (half[first] < 0) ++first;
  std::vector<Eigen::Vector3i> parts;
  std::vector<int> rest;  // a polygon, without the corners between two that are cut off
  for (int i = first; i < first + 3; ++i) {
    const int corner = corners[(i + 1) % 3];
    const int before = half[i % 3];
    const int after = half[(i + 1) % 3];
    if (before >= 0) rest.push_back(before);
    if (before >= 0 && after >= 0) {
      parts.emplace_back(before, corner, after);
    } else {
      rest.push_back(corner);
    }
  }
  for (size_t i = 2; i < rest.size(); ++i) parts.emplace_back(rest[0], rest[i - 1], rest[i]);
  return parts;
}

// Replaces each triangle that is cut by its parts: the first in its place, the others at the end.
void CutTriangles(std::span<const Cut> cuts, mesh::TriangleMesh& mesh) {
  int64_t next = mesh.num_triangles();
  mesh.triangles.conservativeResize(3, next + std::ssize(cuts));
  while (!cuts.empty()) {
    const int32_t t = cuts[0].side / 3;
    std::array<int, 3> half = {-1, -1, -1};
    for (; !cuts.empty() && cuts[0].side / 3 == t; cuts = cuts.subspan(1)) {
      half[cuts[0].side % 3] = cuts[0].vertex;
    }
    const std::vector<Eigen::Vector3i> parts = Parts(mesh.triangles.col(t), half);
    mesh.triangles.col(t) = parts[0];
    for (size_t i = 1; i < parts.size(); ++i) mesh.triangles.col(next++) = parts[i];
  }
  assert(next == mesh.num_triangles());
}

}  // namespace

void PairAcrossLiquid(const mesh::TriangleMesh& mesh, std::span<int32_t> sides) {
  std::vector<Spoke> spokes = FindSpokes(mesh, sides);
  SortAround(spokes);
  // As brackets are matched; what is left, ")) ... ((", is matched around the end.
  std::vector<int32_t> open;
  std::vector<int32_t> closed;
  size_t next = 0;
  const auto pair_with_last_open = [&](int32_t side) {
    sides[next++] = open.back();
    sides[next++] = side;
    open.pop_back();
  };
  for (const Spoke& spoke : spokes) {
    if (spoke.opens) {
      open.push_back(spoke.side);
    } else if (open.empty()) {
      closed.push_back(spoke.side);
    } else {
      pair_with_last_open(spoke.side);
    }
  }
  assert(open.size() == closed.size());
  for (const int32_t side : closed) pair_with_last_open(side);
}

int64_t DropBackToBack(mesh::TriangleMesh& mesh) {
  struct Key {
    std::array<int, 3> corners;  // ascending
    bool is_odd;                 // whether ascending is against the triangle's direction
    int32_t triangle;
  };
  std::vector<Key> keys;
  keys.reserve(mesh.num_triangles());
  for (int32_t t = 0; t < mesh.num_triangles(); ++t) {
    const Eigen::Vector3i c = mesh.triangles.col(t);
    Key key = {{c[0], c[1], c[2]}, (c[0] < c[1]) + (c[1] < c[2]) + (c[2] < c[0]) == 1, t};
    std::sort(key.corners.begin(), key.corners.end());
    keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    if (a.corners != b.corners) return a.corners < b.corners;
    return a.is_odd != b.is_odd ? b.is_odd : a.triangle < b.triangle;
  });
  std::vector<bool> is_dropped(mesh.num_triangles(), false);
  for (auto begin = keys.begin(), end = begin; begin != keys.end(); begin = end) {
    end =
        std::find_if(begin, keys.end(), [&](const Key& k) { return k.corners != begin->corners; });
    const auto odd = std::find_if(begin, end, [](const Key& key) { return key.is_odd; });
    const auto num_pairs = std::min(odd - begin, end - odd);
    for (int64_t i = 0; i < num_pairs; ++i) {
      is_dropped[begin[i].triangle] = is_dropped[odd[i].triangle] = true;
    }
  }
  int64_t kept = 0;
  for (int64_t t = 0; t < mesh.num_triangles(); ++t) {
    if (!is_dropped[t]) mesh.triangles.col(kept++) = mesh.triangles.col(t);
  }
  const int64_t num_dropped = mesh.num_triangles() - kept;
  if (num_dropped > 0) mesh.triangles.conservativeResize(3, kept);
  return num_dropped;
}

absl::StatusOr<int64_t> HalveSharedEdges(const Neighbours& neighbours, mesh::TriangleMesh& mesh) {
  const std::vector<int32_t> sides = FindSharedSides(mesh);
  const int64_t num_added = std::ssize(sides);
  if (num_added == 0) return 0;
  if (2 * num_added > mesh.num_triangles()) {
    return absl::InvalidArgumentError(absl::StrCat("the surface touches itself along ", num_added,
                                                   " edges and more, too many for ",
                                                   mesh.num_triangles(), " triangles"));
  }
  CutTriangles(CutSides(neighbours, sides, mesh), mesh);
  return num_added;
}

}  // namespace liquidblend::ingest
