#include "worker/registration/features/pre_roll.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/mesh/components.h"
#include "worker/registration/features/height_field.h"
#include "worker/registration/features/lumps.h"
#include "worker/registration/features/pair_features.h"
#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/cut_surface.h"

namespace liquidblend::registration {
namespace {

constexpr double kCutEdges = 1.5;  // what is cut off around the target's part
// Air below the part: also a coarser grid has a point in it everywhere.
constexpr double kGapEdges = 4.0;
// Of a vertex of the part from its surface, at most: edges of the mesh ...
constexpr double kOfPartEdges = 1.0;
constexpr double kOfPartGap = 0.5;      // ... and as a share of the air below the part
constexpr double kHeightSpacing = 0.5;  // edges; of the heights below a part

// The first frame of an animation in mean edges, and what stands out of it.
struct FirstFrame {
  mesh::TriangleMesh surface;
  std::vector<int32_t> roots;    // per vertex: its component
  std::vector<int32_t> root_of;  // per track
  Features features;
};

mesh::TriangleMesh InEdges(const mesh::TriangleMesh& surface, double edge_length_m) {
  mesh::TriangleMesh result = surface;
  result.normals.resize(3, 0);
  result.vertices /= static_cast<float>(edge_length_m);
  return result;
}

// The vertices of each component, by its lowest one.
std::map<int32_t, std::vector<int32_t>> VerticesByRoot(const std::vector<int32_t>& roots) {
  std::map<int32_t, std::vector<int32_t>> vertices;
  for (int32_t v = 0; v < static_cast<int32_t>(roots.size()); ++v) vertices[roots[v]].push_back(v);
  return vertices;
}

std::map<int32_t, mesh::Component> ComponentsByRoot(const mesh::TriangleMesh& surface,
                                                    const std::vector<int32_t>& roots) {
  const std::vector<mesh::Component> components = mesh::FindComponents(surface);
  std::map<int32_t, mesh::Component> by_root;
  size_t next = 0;  // components are in the order of their first triangles
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    const int32_t root = roots[surface.triangles(0, t)];
    if (!by_root.contains(root)) by_root[root] = components[next++];
  }
  return by_root;
}

Part PartOf(const mesh::TriangleMesh& surface, const std::vector<int32_t>& vertices) {
  Part part;
  for (const int32_t v : vertices) {
    part.centre.head<3>() += surface.vertices.col(v).cast<double>();
  }
  part.num_vertices = static_cast<int64_t>(vertices.size());
  part.centre /= static_cast<double>(part.num_vertices);
  for (const int32_t v : vertices) {
    const Eigen::Vector3d offset = surface.vertices.col(v).cast<double>() - part.centre.head<3>();
    for (size_t k = 0; k < kReachDirections.size(); ++k) {
      const auto& d = kReachDirections[k];
      part.reach[k] = std::max(part.reach[k], offset.dot(Eigen::Vector3d(d[0], d[1], d[2])));
    }
  }
  return part;
}

// The triangles of one component, with their vertices alone.
mesh::TriangleMesh Component(const mesh::TriangleMesh& surface, const std::vector<int32_t>& roots,
                             int32_t root) {
  std::vector<int32_t> number(roots.size(), -1);
  mesh::TriangleMesh result;
  result.vertices.resize(3, std::count(roots.begin(), roots.end(), root));
  int32_t count = 0;
  for (size_t v = 0; v < roots.size(); ++v) {
    if (roots[v] != root) continue;
    result.vertices.col(count) = surface.vertices.col(static_cast<Eigen::Index>(v));
    number[v] = count++;
  }
  std::vector<Eigen::Vector3i> triangles;
  for (Eigen::Index t = 0; t < surface.num_triangles(); ++t) {
    const Eigen::Vector3i corners = surface.triangles.col(t);
    if (roots[corners[0]] != root) continue;
    triangles.push_back({number[corners[0]], number[corners[1]], number[corners[2]]});
  }
  result.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) {
    result.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }
  return result;
}

// The detached parts of a first frame, as tracks of a frame, and its lumps.
FirstFrame FirstFrameOf(const mesh::TriangleMesh& surface, mesh::Up up, double edge_length_m,
                        const SmallestPart& smallest) {
  const TrackOptions limits{.min_diameter = smallest.diameter_edges};
  FirstFrame first{InEdges(surface, edge_length_m), mesh::ComponentRoots(surface), {}, {}};
  const auto components = ComponentsByRoot(first.surface, first.roots);
  double all = 0;
  for (const auto& [root, component] : components) all += std::max(0.0, component.volume);
  const auto vertices = VerticesByRoot(first.roots);
  for (const auto& [root, component] : components) {
    Track track;
    track.end = TrackEnd::kMerge;
    track.end_time = 1;
    track.volume = component.volume;
    if (track.diameter() < limits.min_diameter || track.volume > limits.max_share * all) continue;
    if (component.area < smallest.area_edges2) continue;
    track.parts = {PartOf(first.surface, vertices.at(root))};
    first.features.tracks.push_back(std::move(track));
    first.root_of.push_back(root);
  }
  first.features.up = up;
  first.features.lumps = FindLumps(first.surface, mesh::AxisOf(up), smallest.diameter_edges);
  return first;
}

double DiagonalOf(const mesh::TriangleMesh& a, const mesh::TriangleMesh& b) {
  Eigen::AlignedBox3f box;
  for (const mesh::TriangleMesh* const surface : {&a, &b}) {
    box.extend(surface->vertices.rowwise().minCoeff());
    box.extend(surface->vertices.rowwise().maxCoeff());
  }
  return box.diagonal().norm();
}

// The parts of a target that are joined with the rest in the source, moved to their lumps there. By
// number of lump, so that the same one is not cut off for two targets.
void AppendJoined(const FirstFrame& source, const FirstFrame& target,
                  std::map<int, mesh::TriangleMesh>& parts) {
  const SceneScale scale{DiagonalOf(source.surface, target.surface), 1.0};
  const JoinedTracks joined = FindJoinedTracks(source.features, target.features, scale);
  const mesh::HeightAxis up = mesh::AxisOf(source.features.up);
  for (const JoinedTrack& track : joined.target) {
    const Lump& from = target.features.lumps[track.own_lump];
    const Lump& to = source.features.lumps[track.other_lump];
    mesh::TriangleMesh part = Component(target.surface, target.roots, target.root_of[track.track]);
    const Eigen::Vector3d shift =
        PointAt(to.place - from.place, up.sign * (to.height - from.height), up);
    part.vertices.colwise() += shift.cast<float>();
    parts.emplace(track.other_lump, std::move(part));
  }
}

// A surface's vertices and normals, to find out what lies within or close to it.
class NearPart {
 public:
  explicit NearPart(const mesh::TriangleMesh& part)
      : points_(Points::Zero(4, part.num_vertices())), normals_(3, part.num_vertices()) {
    points_.topRows<3>() = part.vertices;
    normals_.setZero();
    for (Eigen::Index t = 0; t < part.num_triangles(); ++t) {
      const Eigen::Vector3i c = part.triangles.col(t);
      const Eigen::Vector3f a = part.vertices.col(c[0]);
      const Eigen::Vector3f normal =
          (part.vertices.col(c[1]) - a).cross(part.vertices.col(c[2]) - a);
      for (int k = 0; k < 3; ++k) normals_.col(c[k]) += normal;
    }
    for (auto normal : normals_.colwise()) normal.stableNormalize();
    low_ = part.vertices.rowwise().minCoeff();
    high_ = part.vertices.rowwise().maxCoeff();
    std::vector<int32_t> all(static_cast<size_t>(part.num_vertices()));
    for (size_t v = 0; v < all.size(); ++v) all[v] = static_cast<int32_t>(v);
    tree_.emplace(points_, all, parallel::Arena(1));
  }
  // Whether a point is inside of the part, or closer than `margin` to its surface: within its box,
  // and not as high above the tangent plane of the nearest vertex.
  bool IsWithin(const Eigen::Vector3f& point, double margin) const {
    const float grown = static_cast<float>(margin);
    if ((point.array() < low_.array() - grown).any()) return false;
    if ((point.array() > high_.array() + grown).any()) return false;
    const std::optional<int32_t> nearest = NearestTo(point);
    return nearest && normals_.col(*nearest).dot(point - VertexAt(*nearest)) < margin;
  }
  // Whether a point is next to the surface: within `margin` of the tangent plane of a vertex that
  // is hardly further than that.
  bool IsNextTo(const Eigen::Vector3f& point, double margin) const {
    const std::optional<int32_t> nearest = NearestTo(point);
    if (!nearest) return false;
    const Eigen::Vector3f offset = point - VertexAt(*nearest);
    return offset.norm() <= kNextShare * margin &&
           std::abs(normals_.col(*nearest).dot(offset)) <= margin;
  }

 private:
  static constexpr double kNextShare = 2.0;

  Eigen::Vector3f VertexAt(int32_t vertex) const { return points_.col(vertex).head<3>(); }
  std::optional<int32_t> NearestTo(const Eigen::Vector3f& point) const {
    Eigen::Vector4f query = Eigen::Vector4f::Zero();
    query.head<3>() = point;
    std::array<int32_t, 1> found = {0};
    if (tree_->Nearest(query, found) == 0) return std::nullopt;
    return found[0];
  }

  Points points_;
  Eigen::Vector3f low_, high_;
  Eigen::Matrix3Xf normals_;  // unit length, or zero
  std::optional<PointTree> tree_;
};

// Raises the part until there is a gap of air between it and the liquid below. Returns by how much.
double Raise(const mesh::TriangleMesh& below, const mesh::HeightAxis& up,
             mesh::TriangleMesh& part) {
  const Eigen::Vector3d low = part.vertices.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d high = part.vertices.rowwise().maxCoeff().cast<double>();
  const double half_width = PlaceOf(high - low, up).maxCoeff() / 2 + kGapEdges;
  const HeightField heights(below, up, PlaceOf((low + high) / 2, up), half_width, kHeightSpacing,
                            Seen::kLargestPart);
  double rise = 0;
  for (Eigen::Index v = 0; v < part.num_vertices(); ++v) {
    const Eigen::Vector3d point = part.vertices.col(v).cast<double>();
    const double height = heights.At(PlaceOf(point, up));
    if (std::isnan(height)) continue;
    rise = std::max(rise, height + kGapEdges - up.sign * point[up.axis]);
  }
  part.vertices.row(up.axis).array() += static_cast<float>(up.sign * rise);
  return rise;
}

// Whether a part is clear of everything else.
bool HasRoom(const NearPart& part, const mesh::TriangleMesh& surface) {
  for (Eigen::Index v = 0; v < surface.num_vertices(); ++v) {
    if (part.IsWithin(surface.vertices.col(v), kCutEdges)) return false;
  }
  return true;
}

// Adds a closed surface that is apart from the first one.
void Append(const mesh::TriangleMesh& part, mesh::TriangleMesh& surface) {
  const Eigen::Index before = surface.num_vertices(), triangles = surface.num_triangles();
  surface.vertices.conservativeResize(3, before + part.num_vertices());
  surface.vertices.rightCols(part.num_vertices()) = part.vertices;
  if (surface.velocities.cols() > 0) {
    surface.velocities.conservativeResize(3, before + part.num_vertices());
    surface.velocities.rightCols(part.num_vertices()).setZero();
  }
  surface.triangles.conservativeResize(3, triangles + part.num_triangles());
  surface.triangles.rightCols(part.num_triangles()) =
      part.triangles.array() + static_cast<int>(before);
}

}  // namespace

std::optional<PreRoll> FindPreRoll(const mesh::TriangleMesh& source,
                                   std::span<const mesh::TriangleMesh> targets, mesh::Up up,
                                   const SmallestPart& smallest) {
  const double edge_length_m = mesh::MeanEdgeLength(source);
  if (!(edge_length_m > 0)) return std::nullopt;
  const FirstFrame first = FirstFrameOf(source, up, edge_length_m, smallest);
  std::map<int, mesh::TriangleMesh> parts;
  for (const mesh::TriangleMesh& target : targets) {
    if (target.num_triangles() == 0) continue;
    AppendJoined(first, FirstFrameOf(target, up, edge_length_m, smallest), parts);
  }
  if (parts.empty()) return std::nullopt;
  const std::set<int32_t> detached(first.root_of.begin(), first.root_of.end());
  CutSurface cut(first.surface);
  for (const auto& [lump, part] : parts) {
    const NearPart near(part);
    for (Eigen::Index v = 0; v < first.surface.num_vertices(); ++v) {
      if (detached.contains(first.roots[v])) continue;
      if (near.IsWithin(first.surface.vertices.col(v), kCutEdges)) cut.Cut(v);
    }
  }
  std::optional<mesh::TriangleMesh> surface = cut.Close();
  if (!surface) return std::nullopt;
  const mesh::TriangleMesh below = *surface;
  const mesh::HeightAxis height = mesh::AxisOf(up);
  PreRoll result;
  result.gap_m = kGapEdges * edge_length_m;
  for (auto& [lump, part] : parts) {
    const double rise = Raise(below, height, part);
    if (!HasRoom(NearPart(part), *surface)) return std::nullopt;
    Append(part, *surface);
    part.vertices *= static_cast<float>(edge_length_m);
    CutPart& added = result.parts.emplace_back();
    added.surface = std::move(part);
    added.rise_m[height.axis] = height.sign * rise * edge_length_m;
  }
  surface->vertices *= static_cast<float>(edge_length_m);
  if (!mesh::CheckClosed(*surface).closed()) return std::nullopt;
  result.surface = *std::move(surface);
  return result;
}

void LowerParts(const PreRoll& pre_roll, const parallel::Arena& arena, mesh::SpaceTimeMesh& mesh) {
  const double tolerance_m =
      std::min(kOfPartEdges * mesh.edge_length_m, kOfPartGap * pre_roll.gap_m);
  for (const CutPart& part : pre_roll.parts) {
    const NearPart near(part.surface);
    arena.For(mesh.num_vertices(), [&](int64_t v) {
      if (!(mesh.vertices(3, v) < 0)) return;
      // In the last frame of the pre-roll the part sinks.
      const float share = std::min(1.0F, -mesh.vertices(3, v));
      const Eigen::Vector3f rise = (share * part.rise_m.cast<float>()).eval();
      const Eigen::Vector3f sunk = (1 - share) * part.rise_m.cast<float>();
      const Eigen::Vector3f point = mesh.vertices.col(v).head<3>();
      if (near.IsNextTo(point + sunk, tolerance_m)) {
        mesh.vertices.col(v).head<3>() = point - rise;
      }
    });
  }
}

}  // namespace liquidblend::registration
