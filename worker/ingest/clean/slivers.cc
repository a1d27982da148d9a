#include "worker/ingest/clean/slivers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

namespace liquidblend::ingest {
namespace {

using Eigen::Vector3d;

constexpr int kMaxPasses = 8;
constexpr size_t kMaxRing = 128;       // larger rings are left alone, so that the cost stays linear
constexpr double kSpeckShare = 0.001;  // of the mean edge length

struct Shape {
  double longest_m = 0.0;
  double height_m = 0.0;  // over the longest side
  int longest_side = 0;
  int shortest_side = 0;
  bool is_sliver() const { return height_m <= kSliverShare * longest_m; }
};

class SliverRemover {
 public:
  SliverRemover(Neighbours neighbours, mesh::TriangleMesh& mesh)
      : mesh_(mesh),
        neighbours_(std::move(neighbours)),
        is_alive_(neighbours_.size(), true),
        triangle_of_(mesh.num_vertices(), -1),
        speck_size_m_(kSpeckShare * mesh::MeanEdgeLength(mesh)) {
    for (int32_t t = 0; t < num_triangles(); ++t) {
      for (int k = 0; k < 3; ++k) triangle_of_[mesh_.triangles(k, t)] = t;
    }
  }

  SliverCounts Run() {
    SliverCounts counts;
    DropSpecks(counts);
    const int64_t num_before = NumSlivers();
    bool has_changed = num_before > 0;
    for (int pass = 0; pass < kMaxPasses && has_changed; ++pass) {
      has_changed = false;
      for (int32_t t = 0; t < num_triangles(); ++t) {
        if (is_alive_[t] && ShapeOf(t).is_sliver()) has_changed |= Remove(t);
      }
    }
    counts.num_left = NumSlivers();
    counts.num_removed = std::max<int64_t>(0, num_before - counts.num_left);
    Compact();
    return counts;
  }

 private:
  int32_t num_triangles() const { return static_cast<int32_t>(neighbours_.size()); }
  int32_t Corner(int32_t t, int k) const { return mesh_.triangles(k % 3, t); }
  Vector3d Position(int32_t v) const { return mesh_.vertices.col(v).cast<double>(); }

  Vector3d DoubleArea(int32_t a, int32_t b, int32_t c) const {
    return (Position(b) - Position(a)).cross(Position(c) - Position(a));
  }

  Shape ShapeOf(int32_t a, int32_t b, int32_t c) const {
    const double length_m[3] = {(Position(b) - Position(a)).norm(),
                                (Position(c) - Position(b)).norm(),
                                (Position(a) - Position(c)).norm()};
    Shape shape;
    shape.longest_side = static_cast<int>(std::max_element(length_m, length_m + 3) - length_m);
    shape.shortest_side = static_cast<int>(std::min_element(length_m, length_m + 3) - length_m);
    shape.longest_m = length_m[shape.longest_side];
    if (shape.longest_m > 0) shape.height_m = DoubleArea(a, b, c).norm() / shape.longest_m;
    return shape;
  }
  Shape ShapeOf(int32_t t) const { return ShapeOf(Corner(t, 0), Corner(t, 1), Corner(t, 2)); }

  int64_t NumSlivers() const {
    int64_t count = 0;
    for (int32_t t = 0; t < num_triangles(); ++t) count += is_alive_[t] && ShapeOf(t).is_sliver();
    return count;
  }

  int CornerOf(int32_t t, int32_t v) const {
    return Corner(t, 0) == v ? 0 : Corner(t, 1) == v ? 1 : 2;
  }

  // Triangles around v in order, one after the other across the side that starts at v. False if
  // there are too many of them.
  bool Ring(int32_t v, std::vector<int32_t>& ring) const {
    ring.clear();
    const int32_t first = triangle_of_[v];
    int32_t t = first;
    do {
      if (ring.size() == kMaxRing) return false;
      ring.push_back(t);
      t = neighbours_[t][CornerOf(t, v)];
    } while (t != first);
    return true;
  }

  bool RingHasVertex(const std::vector<int32_t>& ring, int32_t v) const {
    return std::any_of(ring.begin(), ring.end(), [&](int32_t t) {
      return Corner(t, 0) == v || Corner(t, 1) == v || Corner(t, 2) == v;
    });
  }

  // Makes n, which has the side from a to b, a neighbour of t across it.
  void Link(int32_t n, int32_t a, int32_t b, int32_t t) {
    const int k = CornerOf(n, a);
    assert(Corner(n, k) == a && Corner(n, k + 1) == b);
    static_cast<void>(b);
    neighbours_[n][k] = t;
  }

  bool Remove(int32_t t) {
    const Shape shape = ShapeOf(t);
    return CollapseShortestSide(t, shape) || FlipLongestSide(t, shape) || TakeOutCorner(t, shape);
  }

  bool CollapseShortestSide(int32_t t, const Shape& shape) {
    const int32_t a = Corner(t, shape.shortest_side);
    const int32_t b = Corner(t, shape.shortest_side + 1);
    if ((Position(a) - Position(b)).norm() > kShortSideShare * shape.longest_m) return false;
    const auto [low, high] = std::minmax(a, b);
    return (KeepsFacing(high, low) && Collapse(high, low)) ||
           (KeepsFacing(low, high) && Collapse(low, high));
  }

  // Whether no sound triangle around `gone` turns over when its corner moves to `kept`.
  bool KeepsFacing(int32_t gone, int32_t kept) {
    if (!Ring(gone, ring_)) return false;
    for (const int32_t t : ring_) {
      const int k = CornerOf(t, gone);
      const int32_t b = Corner(t, k + 1);
      const int32_t c = Corner(t, k + 2);
      if (b == kept || c == kept || ShapeOf(t).is_sliver()) continue;
      if (DoubleArea(gone, b, c).dot(DoubleArea(kept, b, c)) <= 0) return false;
    }
    return true;
  }

  // Merges `gone` into `kept`, a neighbour, if the surface stays a manifold: the two share no other
  // neighbours than those of their two triangles, and are not part of a tetrahedron.
  bool Collapse(int32_t gone, int32_t kept) {
    if (!Ring(gone, ring_) || !Ring(kept, other_ring_)) return false;
    if (ring_.size() <= 3 && other_ring_.size() <= 3) return false;
    int num_shared = 0;
    int32_t left = -1;   // triangle with the side from gone to kept
    int32_t right = -1;  // triangle with the side from kept to gone
    for (const int32_t t : ring_) {
      const int32_t next = Corner(t, CornerOf(t, gone) + 1);  // each neighbour of gone, once
      if (next != kept && RingHasVertex(other_ring_, next)) ++num_shared;
      if (next == kept) left = t;
      if (Corner(t, CornerOf(t, gone) + 2) == kept) right = t;
    }
    if (num_shared != 2 || left < 0 || right < 0) return false;
    Close(left, kept, gone);
    Close(right, gone, kept);
    for (const int32_t t : ring_) mesh_.triangles(CornerOf(t, gone), t) = kept;
    return true;
  }

  // Takes triangle t = (x, y, apex) with the collapsing side (x, y) or its reverse out: its other
  // two neighbours become neighbours of each other.
  void Close(int32_t t, int32_t kept_or_gone, int32_t other) {
    const int k = CornerOf(t, other);  // (other, kept_or_gone, apex) in cyclic order
    const int32_t apex = Corner(t, k + 2);
    const int32_t n = neighbours_[t][(k + 1) % 3];  // across (kept_or_gone, apex)
    const int32_t m = neighbours_[t][(k + 2) % 3];  // across (apex, other)
    Link(n, apex, kept_or_gone, m);
    Link(m, other, apex, n);
    triangle_of_[apex] = n;
    triangle_of_[kept_or_gone] = n;
    triangle_of_[other] = m;
    is_alive_[t] = false;
  }

  // Turns the long side of a cap, (a, b) with the cap's tip c and the tip d across, into (c, d).
  bool FlipLongestSide(int32_t t, const Shape& shape) {
    const int k = shape.longest_side;
    const int32_t s = neighbours_[t][k];
    const int32_t a = Corner(t, k);
    const int32_t b = Corner(t, k + 1);
    const int32_t c = Corner(t, k + 2);
    const int j = CornerOf(s, b);
    const int32_t d = Corner(s, j + 2);
    if (c == d || !Ring(c, ring_) || RingHasVertex(ring_, d)) return false;
    const double before_m = std::min(shape.height_m, ShapeOf(s).height_m);
    if (std::min(ShapeOf(a, d, c).height_m, ShapeOf(d, b, c).height_m) <= before_m) return false;
    const int32_t bc = neighbours_[t][(k + 1) % 3];
    const int32_t ca = neighbours_[t][(k + 2) % 3];
    const int32_t ad = neighbours_[s][(j + 1) % 3];
    const int32_t db = neighbours_[s][(j + 2) % 3];
    mesh_.triangles.col(t) << a, d, c;
    mesh_.triangles.col(s) << d, b, c;
    neighbours_[t] = {ad, s, ca};
    neighbours_[s] = {db, bc, t};
    Link(ad, d, a, t);
    Link(bc, c, b, s);
    triangle_of_[a] = triangle_of_[c] = triangle_of_[d] = t;
    triangle_of_[b] = s;
    return true;
  }

  // Takes out a corner of t that has three triangles and lies in the plane of its neighbours.
  bool TakeOutCorner(int32_t t, const Shape& shape) {
    for (int k = 0; k < 3; ++k) {
      const int32_t v = Corner(t, k);
      if (!Ring(v, ring_) || ring_.size() != 3) continue;
      int32_t around[3];
      for (int i = 0; i < 3; ++i) around[i] = Corner(ring_[i], CornerOf(ring_[i], v) + 2);
      const Vector3d normal = DoubleArea(around[0], around[1], around[2]).normalized();
      const double height_m = std::abs(normal.dot(Position(v) - Position(around[0])));
      if (normal.isZero() || height_m > kSliverShare * shape.longest_m) continue;
      if (Collapse(v, around[0])) return true;
    }
    return false;
  }

  // Drops parts that are two triangles back to back, or have no extent.
  void DropSpecks(SliverCounts& counts) {
    std::vector<bool> is_seen(neighbours_.size(), false);
    std::vector<int32_t> part;
    for (int32_t first = 0; first < num_triangles(); ++first) {
      if (is_seen[first]) continue;
      part.assign(1, first);
      is_seen[first] = true;
      Eigen::AlignedBox3d box;
      for (size_t i = 0; i < part.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
          box.extend(Position(Corner(part[i], k)));
          const int32_t n = neighbours_[part[i]][k];
          if (!is_seen[n]) part.push_back(n);
          is_seen[n] = true;
        }
      }
      if (part.size() > 2 && box.diagonal().norm() > speck_size_m_) continue;
      ++counts.num_specks;
      for (const int32_t t : part) is_alive_[t] = false;
    }
  }

  void Compact() {
    int32_t kept = 0;
    for (int32_t t = 0; t < num_triangles(); ++t) {
      if (is_alive_[t]) mesh_.triangles.col(kept++) = mesh_.triangles.col(t);
    }
    mesh_.triangles.conservativeResize(3, kept);
  }

  mesh::TriangleMesh& mesh_;
  Neighbours neighbours_;
  std::vector<bool> is_alive_;        // per triangle
  std::vector<int32_t> triangle_of_;  // per vertex, one of its triangles
  double speck_size_m_;
  std::vector<int32_t> ring_;
  std::vector<int32_t> other_ring_;
};

}  // namespace

SliverCounts RemoveSlivers(Neighbours neighbours, mesh::TriangleMesh& mesh) {
  return SliverRemover(std::move(neighbours), mesh).Run();
}

}  // namespace liquidblend::ingest
