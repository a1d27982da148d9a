#include "tests/synthetic/tracked.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "tests/synthetic/shapes.h"

namespace liquidblend::synthetic {
namespace {

using mesh::TriangleMesh;

// The mesh at frame 0, stretched to frame k.
TriangleMesh Stretched(TriangleMesh mesh, int k, const TrackedSequenceOptions& options) {
  const auto rate = static_cast<float>(options.stretch_per_frame);
  const Eigen::Vector3f rates(rate, -rate / 2, -rate / 2);
  const Eigen::Vector3f scale = Eigen::Vector3f::Ones() + static_cast<float>(k) * rates;
  const auto frames_per_second = static_cast<float>(options.frames_per_second);
  mesh.velocities = frames_per_second * (rates.asDiagonal() * mesh.vertices);
  mesh.vertices = scale.asDiagonal() * mesh.vertices;
  return mesh;
}

// A closed triangle mesh that edges are flipped, split and collapsed in. Plain lists, searched from
// one end to the other: for small meshes.
class Remesher {
 public:
  Remesher(const TriangleMesh& mesh, uint64_t seed) : random_(seed) {
    for (int64_t v = 0; v < mesh.num_vertices(); ++v) points_.push_back(mesh.vertices.col(v));
    for (int64_t t = 0; t < mesh.num_triangles(); ++t) {
      triangles_.push_back({mesh.triangles(0, t), mesh.triangles(1, t), mesh.triangles(2, t)});
    }
  }

  void FlipOne() {
    const auto [a, b] = RandomEdge();
    const int c = Opposite(a, b);
    const int d = Opposite(b, a);
    if (AreNeighbours(c, d) || Degree(a) <= 4 || Degree(b) <= 4) return;
    Remove(a, b);
    Remove(b, a);
    triangles_.push_back({a, d, c});
    triangles_.push_back({d, b, c});
  }

  void SplitOne() {
    const auto [a, b] = RandomEdge();
    const int c = Opposite(a, b);
    const int d = Opposite(b, a);
    const int middle = static_cast<int>(points_.size());
    points_.push_back((points_[a] + points_[b]) / 2);
    Remove(a, b);
    Remove(b, a);
    for (const Triangle& t : {Triangle{a, middle, c}, Triangle{middle, b, c},
                              Triangle{b, middle, d}, Triangle{middle, a, d}}) {
      triangles_.push_back(t);
    }
  }

  void CollapseOne() {
    const auto [a, b] = RandomEdge();
    const int c = Opposite(a, b);
    const int d = Opposite(b, a);
    if (NumCommonNeighbours(a, b) != 2 || Degree(c) <= 4 || Degree(d) <= 4) return;
    points_[a] = (points_[a] + points_[b]) / 2;
    Remove(a, b);
    Remove(b, a);
    for (Triangle& t : triangles_) {
      for (int& v : t) {
        if (v == b) v = a;
        if (v > b) --v;  // a may lie behind b, too
      }
    }
    points_.erase(points_.begin() + b);
  }

  TriangleMesh Result() const {
    TriangleMesh mesh;
    mesh.vertices.resize(3, static_cast<int64_t>(points_.size()));
    mesh.triangles.resize(3, static_cast<int64_t>(triangles_.size()));
    for (size_t v = 0; v < points_.size(); ++v) {
      mesh.vertices.col(static_cast<int64_t>(v)) = points_[v];
    }
    for (size_t t = 0; t < triangles_.size(); ++t) {
      mesh.triangles.col(static_cast<int64_t>(t)) =
          Eigen::Vector3i(triangles_[t][0], triangles_[t][1], triangles_[t][2]);
    }
    return mesh;
  }

 private:
  using Triangle = std::array<int, 3>;

  std::pair<int, int> RandomEdge() {
    const Triangle& t = triangles_[random_() % triangles_.size()];
    const auto k = random_() % 3;
    return {t[k], t[(k + 1) % 3]};
  }
  // The place of a -> b in a triangle, or -1.
  static int SideOf(const Triangle& t, int a, int b) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] == a && t[(k + 1) % 3] == b) return k;
    }
    return -1;
  }
  std::vector<Triangle>::const_iterator FindSide(int a, int b) const {
    return std::find_if(triangles_.begin(), triangles_.end(),
                        [&](const Triangle& t) { return SideOf(t, a, b) >= 0; });
  }
  int Opposite(int a, int b) const {
    const Triangle& t = *FindSide(a, b);
    return t[(SideOf(t, a, b) + 2) % 3];
  }
  bool AreNeighbours(int a, int b) const { return FindSide(a, b) != triangles_.end(); }
  int Degree(int v) const {
    return static_cast<int>(std::count_if(triangles_.begin(), triangles_.end(), [&](const auto& t) {
      return std::find(t.begin(), t.end(), v) != t.end();
    }));
  }
  int NumCommonNeighbours(int a, int b) const {
    int num = 0;
    for (int v = 0; v < static_cast<int>(points_.size()); ++v) {
      num += AreNeighbours(a, v) && AreNeighbours(b, v);
    }
    return num;
  }
  void Remove(int a, int b) { triangles_.erase(FindSide(a, b)); }

  std::mt19937_64 random_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<Triangle> triangles_;
};

mesh::Animation Sequence(const char* name, const TrackedSequenceOptions& options) {
  mesh::Animation animation;
  animation.name = name;
  animation.frames_per_second = options.frames_per_second;
  return animation;
}

constexpr float kCapBegins = 0.85f;  // x of a unit sphere

// The sphere without its cap around +x; vertices renumbered.
TriangleMesh WithoutCap(const TriangleMesh& sphere) {
  std::vector<Eigen::Vector3i> kept;
  std::map<int, int> numbers;
  TriangleMesh open;
  for (int64_t t = 0; t < sphere.num_triangles(); ++t) {
    Eigen::Vector3i corners = sphere.triangles.col(t);
    const auto is_in_cap = [&](int v) { return sphere.vertices(0, v) > kCapBegins; };
    if (std::any_of(corners.begin(), corners.end(), is_in_cap)) continue;
    for (int& v : corners)
      v = numbers.try_emplace(v, static_cast<int>(numbers.size())).first->second;
    kept.push_back(corners);
  }
  open.vertices.resize(3, static_cast<int64_t>(numbers.size()));
  for (const auto& [old_number, number] : numbers) {
    open.vertices.col(number) = sphere.vertices.col(old_number);
  }
  open.triangles.resize(3, static_cast<int64_t>(kept.size()));
  for (size_t t = 0; t < kept.size(); ++t) open.triangles.col(static_cast<int64_t>(t)) = kept[t];
  return open;
}

// Turned inside out by the mirror, then back.
TriangleMesh MirroredInX(TriangleMesh mesh) {
  mesh.vertices.row(0) *= -1.0f;
  mesh.velocities.row(0) *= -1.0f;
  return Flipped(std::move(mesh));
}

// An open body and its mirror image, joined by a tube along the boundary.
TriangleMesh JoinedByTube(const TriangleMesh& open) {
  TriangleMesh joined = Join(std::array{open, MirroredInX(open)});
  const auto n = static_cast<int>(open.num_vertices());
  std::map<std::pair<int, int>, int> sides;
  for (int64_t t = 0; t < open.num_triangles(); ++t) {
    for (int k = 0; k < 3; ++k) ++sides[{open.triangles(k, t), open.triangles((k + 1) % 3, t)}];
  }
  std::vector<Eigen::Vector3i> tube;
  for (const auto& [side, count] : sides) {
    const auto [a, b] = side;
    if (sides.count({b, a}) > 0) continue;
    tube.emplace_back(b, a, a + n);
    tube.emplace_back(b, a + n, b + n);
  }
  const int64_t first = joined.num_triangles();
  joined.triangles.conservativeResize(3, first + static_cast<int64_t>(tube.size()));
  for (size_t t = 0; t < tube.size(); ++t) {
    joined.triangles.col(first + static_cast<int64_t>(t)) = tube[t];
  }
  return joined;
}

}  // namespace

mesh::Animation SphereToEllipsoid(const TrackedSequenceOptions& options) {
  mesh::Animation animation = Sequence("sphere to ellipsoid", options);
  const TriangleMesh sphere = Icosphere({0, 0, 0}, 1.0, options.subdivisions);
  for (int k = 0; k < options.num_frames; ++k) {
    animation.frames.push_back(Stretched(sphere, k, options));
  }
  return animation;
}

mesh::Animation RemeshedEllipsoid(const RemeshingOptions& options) {
  mesh::Animation animation = Sequence("remeshed ellipsoid", options.sequence);
  Remesher remesher(Icosphere({0, 0, 0}, 1.0, options.sequence.subdivisions), options.seed);
  for (int k = 0; k < options.sequence.num_frames; ++k) {
    animation.frames.push_back(Stretched(remesher.Result(), k, options.sequence));
    for (int n = 0; n < options.flips_per_frame; ++n) remesher.FlipOne();
    for (int n = 0; n < options.splits_per_frame; ++n) remesher.SplitOne();
    for (int n = 0; n < options.collapses_per_frame; ++n) remesher.CollapseOne();
  }
  return animation;
}

mesh::Animation MergingSpheres(const TrackedSequenceOptions& options) {
  mesh::Animation animation = Sequence("merging spheres", options);
  const TriangleMesh whole = Icosphere({0, 0, 0}, 1.0, options.subdivisions);
  const TriangleMesh open = WithoutCap(whole);
  const auto step = static_cast<float>(mesh::MeanEdgeLength(whole));
  const int merge = options.num_frames / 2;  // spheres of radius 1 touch there, nearly
  for (int k = 0; k < options.num_frames; ++k) {
    TriangleMesh half = k < merge ? whole : open;
    const float x = -1.0f - (static_cast<float>(merge - k) - 0.5f) * step / 2;
    half.vertices.colwise() += Eigen::Vector3f(x, 0, 0);
    half.velocities = Eigen::Matrix3Xf::Zero(3, half.num_vertices());
    half.velocities.row(0).setConstant(step / 2 * static_cast<float>(options.frames_per_second));
    animation.frames.push_back(k < merge ? Join(std::array{half, MirroredInX(half)})
                                         : JoinedByTube(half));
  }
  return animation;
}

mesh::Animation SplittingSpheres(const TrackedSequenceOptions& options) {
  mesh::Animation animation = MergingSpheres(options);
  animation.name = "splitting spheres";
  std::reverse(animation.frames.begin(), animation.frames.end());
  for (TriangleMesh& frame : animation.frames) frame.velocities *= -1.0f;
  return animation;
}

mesh::Animation ReplacedEllipsoid(const TrackedSequenceOptions& options) {
  mesh::Animation animation = SphereToEllipsoid(options);
  animation.name = "replaced ellipsoid";
  TriangleMesh other = Box({-1, -1, -1}, {1, 1, 1}, 3 << (options.subdivisions - 1));
  other.vertices.colwise().normalize();
  const Eigen::AngleAxisf turn(1.0f, Eigen::Vector3f(1, 2, 3).normalized());
  other.vertices = (turn.toRotationMatrix() * other.vertices).eval();
  for (int k = options.num_frames / 2; k < options.num_frames; ++k) {
    animation.frames[k] = Stretched(other, k, options);
  }
  return animation;
}

}  // namespace liquidblend::synthetic
