#include "tests/reference/paper_extraction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace liquidblend::reference {
namespace {

using mesh::Tetrahedron;
using mesh::TriangleMesh;

// Collects triangles on crossed edges, one vertex for each.
class Slicer {
 public:
  Slicer(const Eigen::Matrix4Xf& vertices, double time) : vertices_(vertices), time_(time) {}

  void Add(const Tetrahedron& cell) {
    std::array<int32_t, 4> earlier = {};
    std::array<int32_t, 4> later = {};
    int num_earlier = 0;
    int num_later = 0;
    for (const int32_t v : cell) (IsLater(v) ? later[num_later++] : earlier[num_earlier++]) = v;
    if (num_earlier == 0 || num_later == 0) return;
    const bool is_even = IsEvenOrder(cell, earlier, num_earlier, later);
    // With the cell's corners in the order earlier, later: an odd order turns the polygon round.
    if (num_later == 1) {
      AddTriangle(is_even, {earlier[0], later[0]}, {earlier[2], later[0]}, {earlier[1], later[0]});
    } else if (num_earlier == 1) {
      AddTriangle(is_even, {earlier[0], later[0]}, {earlier[0], later[2]}, {earlier[0], later[1]});
    } else {
      const Edge a = {earlier[0], later[1]}, b = {earlier[0], later[0]}, c = {earlier[1], later[0]},
                 d = {earlier[1], later[1]};
      AddTriangle(is_even, a, b, c);
      AddTriangle(is_even, a, c, d);
    }
  }

  TriangleMesh Result() const {
    TriangleMesh surface;
    surface.vertices.resize(3, static_cast<int64_t>(points_.size()));
    surface.triangles.resize(3, static_cast<int64_t>(triangles_.size()));
    for (size_t v = 0; v < points_.size(); ++v) {
      surface.vertices.col(static_cast<int64_t>(v)) = points_[v];
    }
    for (size_t t = 0; t < triangles_.size(); ++t) {
      surface.triangles.col(static_cast<int64_t>(t)) = triangles_[t];
    }
    return surface;
  }

 private:
  using Edge = std::pair<int32_t, int32_t>;

  bool IsLater(int32_t v) const { return static_cast<double>(vertices_(3, v)) >= time_; }

  static bool IsEvenOrder(const Tetrahedron& cell, const std::array<int32_t, 4>& earlier,
                          int num_earlier, const std::array<int32_t, 4>& later) {
    std::array<int64_t, 4> place = {};
    for (int k = 0; k < 4; ++k) {
      const int32_t v = k < num_earlier ? earlier[k] : later[k - num_earlier];
      place[k] = std::find(cell.begin(), cell.end(), v) - cell.begin();
    }
    int num_swapped = 0;
    for (int a = 0; a < 4; ++a) {
      for (int b = a + 1; b < 4; ++b) num_swapped += place[a] > place[b];
    }
    return num_swapped % 2 == 0;
  }

  void AddTriangle(bool is_even, Edge a, Edge b, Edge c) {
    if (!is_even) std::swap(b, c);
    triangles_.emplace_back(Crossing(a), Crossing(b), Crossing(c));
  }

  int Crossing(Edge edge) {
    edge = std::minmax({edge.first, edge.second});
    const uint64_t key =
        static_cast<uint64_t>(edge.first) << 32 | static_cast<uint32_t>(edge.second);
    const auto [entry, is_new] = crossings_.try_emplace(key, static_cast<int>(points_.size()));
    if (is_new) {
      const Eigen::Vector4d a = vertices_.col(edge.first).cast<double>();
      const Eigen::Vector4d b = vertices_.col(edge.second).cast<double>();
      const double s = (time_ - a[3]) / (b[3] - a[3]);
      points_.emplace_back(((1 - s) * a + s * b).head<3>().cast<float>());
    }
    return entry->second;
  }

  const Eigen::Matrix4Xf& vertices_;
  double time_;
  std::unordered_map<uint64_t, int> crossings_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<Eigen::Vector3i> triangles_;
};

int Root(std::vector<int>& parent, int v) {
  while (parent[v] != v) v = parent[v] = parent[parent[v]];
  return v;
}

// Directed sides that no triangle runs through the other way.
std::vector<std::pair<int, int>> OpenSides(const TriangleMesh& surface) {
  std::vector<std::pair<int, int>> sides;
  for (int64_t t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {
      sides.emplace_back(surface.triangles(k, t), surface.triangles((k + 1) % 3, t));
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<std::pair<int, int>> open;
  for (const auto& [a, b] : sides) {
    if (!std::binary_search(sides.begin(), sides.end(), std::pair(b, a))) open.emplace_back(a, b);
  }
  return open;
}

}  // namespace

std::vector<Tetrahedron> SplitWedges(const std::vector<mesh::Wedge>& wedges) {
  std::vector<Tetrahedron> tetrahedra;
  tetrahedra.reserve(3 * wedges.size());
  for (const mesh::Wedge& wedge : wedges) {
    // Corners by label, p < q < r; the diagonals are p r', p q' and q r' with ' for later ones.
    std::array<int, 3> by_label = {0, 1, 2};
    std::sort(by_label.begin(), by_label.end(), [&](int a, int b) { return wedge[a] < wedge[b]; });
    const auto [p, q, r] = by_label;
    const bool is_even = (q - p + 3) % 3 == 1;
    for (const std::array<int, 4>& corners :
         {std::array{p, q, r, r + 3}, std::array{p, q, r + 3, q + 3},
          std::array{p, q + 3, r + 3, p + 3}}) {
      Tetrahedron cell;
      for (int k = 0; k < 4; ++k) cell[k] = wedge[corners[k]];
      if (!is_even) std::swap(cell[0], cell[1]);
      tetrahedra.push_back(cell);
    }
  }
  return tetrahedra;
}

TriangleMesh SliceTetrahedra(const Eigen::Matrix4Xf& vertices,
                             const std::vector<Tetrahedron>& tetrahedra, double time_frames) {
  Slicer slicer(vertices, time_frames);
  for (const Tetrahedron& cell : tetrahedra) slicer.Add(cell);
  return slicer.Result();
}

void FillHoles(TriangleMesh& surface) {
  const std::vector<std::pair<int, int>> open = OpenSides(surface);
  std::vector<int> parent(surface.num_vertices());
  std::iota(parent.begin(), parent.end(), 0);
  for (const auto& [a, b] : open) parent[Root(parent, a)] = Root(parent, b);
  std::unordered_map<int, int> hole_of_root;
  std::vector<Eigen::Vector3f> sums;
  std::vector<float> counts;
  std::vector<Eigen::Vector3i> fan;
  for (const auto& [a, b] : open) {
    const auto [hole, is_new] =
        hole_of_root.try_emplace(Root(parent, a), static_cast<int>(sums.size()));
    if (is_new) {
      sums.emplace_back(Eigen::Vector3f::Zero());
      counts.push_back(0);
    }
    sums[hole->second] += surface.vertices.col(a);
    counts[hole->second] += 1;
    fan.emplace_back(b, a, static_cast<int>(surface.num_vertices()) + hole->second);
  }
  const int64_t num_vertices = surface.num_vertices();
  const int64_t num_triangles = surface.num_triangles();
  surface.vertices.conservativeResize(3, num_vertices + static_cast<int64_t>(sums.size()));
  surface.triangles.conservativeResize(3, num_triangles + static_cast<int64_t>(fan.size()));
  for (size_t h = 0; h < sums.size(); ++h) {
    surface.vertices.col(num_vertices + static_cast<int64_t>(h)) = sums[h] / counts[h];
  }
  for (size_t t = 0; t < fan.size(); ++t) {
    surface.triangles.col(num_triangles + static_cast<int64_t>(t)) = fan[t];
  }
}

void SmoothOnce(TriangleMesh& surface) {
  Eigen::Matrix3Xf sum = Eigen::Matrix3Xf::Zero(3, surface.num_vertices());
  Eigen::VectorXf count = Eigen::VectorXf::Zero(surface.num_vertices());
  for (int64_t t = 0; t < surface.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) {  // each edge of a closed surface is run through twice
      const int a = surface.triangles(k, t);
      sum.col(a) += surface.vertices.col(surface.triangles((k + 1) % 3, t));
      count[a] += 1;
    }
  }
  for (int64_t v = 0; v < surface.num_vertices(); ++v) {
    if (count[v] == 0) continue;
    surface.vertices.col(v) = 0.5f * (surface.vertices.col(v) + sum.col(v) / count[v]).eval();
  }
}

TriangleMesh ExtractAsInThePaper(const Eigen::Matrix4Xf& vertices,
                                 const std::vector<Tetrahedron>& tetrahedra, double time_frames) {
  TriangleMesh surface = SliceTetrahedra(vertices, tetrahedra, time_frames);
  FillHoles(surface);
  SmoothOnce(surface);
  return surface;
}

double RadiusRatio(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const Eigen::Vector3d ab = (b - a).cast<double>();
  const Eigen::Vector3d ac = (c - a).cast<double>();
  const Eigen::Vector3d bc = (c - b).cast<double>();
  const double four_area_sq = ab.cross(ac).squaredNorm();
  const double sides = ab.norm() * ac.norm() * bc.norm() * (ab.norm() + ac.norm() + bc.norm());
  return sides > 0 ? 4 * four_area_sq / sides : 0.0;
}

int64_t NumSlivers(const TriangleMesh& surface) {
  constexpr double kSliver = 0.1;
  int64_t num_slivers = 0;
  for (int64_t t = 0; t < surface.num_triangles(); ++t) {
    const auto corner = [&](int k) {
      return Eigen::Vector3f(surface.vertices.col(surface.triangles(k, t)));
    };
    num_slivers += RadiusRatio(corner(0), corner(1), corner(2)) < kSliver;
  }
  return num_slivers;
}

}  // namespace liquidblend::reference
