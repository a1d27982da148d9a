#include "worker/registration/surface/cut_surface.h"

#include <Eigen/Geometry>
#include <set>
#include <utility>

#include "core/mesh/union_find.h"

namespace liquidblend::registration {
namespace {

constexpr int kMaxRounds = 32;  // of cutting off what is not clean

// Triangles from the rim to a vertex in its middle.
void AddFan(const std::vector<int32_t>& rim, mesh::TriangleMesh& surface,
            std::vector<Eigen::Vector3i>& triangles) {
  const auto middle = static_cast<int32_t>(surface.num_vertices());
  const auto add_mean = [&](Eigen::Matrix3Xf& values) {
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (const int32_t v : rim) mean += values.col(v);
    values.conservativeResize(3, middle + 1);
    values.col(middle) = mean / static_cast<float>(rim.size());
  };
  add_mean(surface.vertices);
  if (surface.velocities.cols() > 0) add_mean(surface.velocities);
  for (size_t k = 0; k < rim.size(); ++k) {
    triangles.push_back({rim[(k + 1) % rim.size()], rim[k], middle});
  }
}

// Leaves out the vertices that no triangle uses.
void DropUnused(mesh::TriangleMesh& surface) {
  std::vector<int32_t> number(static_cast<size_t>(surface.num_vertices()), -1);
  for (const int v : surface.triangles.reshaped()) number[v] = 0;
  int32_t count = 0;
  for (size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = count;
    const auto to = static_cast<Eigen::Index>(count++), from = static_cast<Eigen::Index>(v);
    surface.vertices.col(to) = surface.vertices.col(from);
    if (surface.velocities.cols() > 0) surface.velocities.col(to) = surface.velocities.col(from);
  }
  surface.vertices.conservativeResize(3, count);
  if (surface.velocities.cols() > 0) surface.velocities.conservativeResize(3, count);
  for (int& v : surface.triangles.reshaped()) v = number[v];
}

double AreaOf(const mesh::TriangleMesh& surface, const Eigen::Vector3i& corners) {
  const Eigen::Vector3f a = surface.vertices.col(corners[0]);
  const Eigen::Vector3f b = surface.vertices.col(corners[1]);
  const Eigen::Vector3f c = surface.vertices.col(corners[2]);
  return 0.5 * (b - a).cross(c - a).norm();
}

}  // namespace

std::optional<mesh::TriangleMesh> CutSurface::Close() {
  int round = 0;
  while (CutPinched() || CutIslands()) {
    if (++round == kMaxRounds) return std::nullopt;
  }
  std::vector<Eigen::Vector3i> triangles;
  for (Eigen::Index t = 0; t < surface_.num_triangles(); ++t) {
    if (IsKept(t)) triangles.push_back(surface_.triangles.col(t));
  }
  if (triangles.empty()) return std::nullopt;
  mesh::TriangleMesh closed = surface_;
  closed.normals.resize(3, 0);
  for (const std::vector<int32_t>& rim : Rims()) AddFan(rim, closed, triangles);
  closed.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (size_t t = 0; t < triangles.size(); ++t) {
    closed.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }
  DropUnused(closed);
  return closed;
}

bool CutSurface::IsKept(Eigen::Index triangle) const {
  const Eigen::Vector3i c = surface_.triangles.col(triangle);
  return is_cut_[c[0]] == 0 && is_cut_[c[1]] == 0 && is_cut_[c[2]] == 0;
}

// The directed edges of triangles that are left, whose other triangle is not: those that triangles
// that are cut off run through in the opposite direction.
std::multimap<int32_t, int32_t> CutSurface::RimEdges() const {
  std::map<std::pair<int32_t, int32_t>, int> excess;
  for (Eigen::Index t = 0; t < surface_.num_triangles(); ++t) {
    if (IsKept(t)) continue;
    const Eigen::Vector3i c = surface_.triangles.col(t);
    for (int k = 0; k < 3; ++k) {
      ++excess[{c[(k + 1) % 3], c[k]}];
      --excess[{c[k], c[(k + 1) % 3]}];
    }
  }
  std::multimap<int32_t, int32_t> edges;
  for (const auto& [edge, count] : excess) {
    for (int n = 0; n < count; ++n) edges.emplace(edge.first, edge.second);
  }
  return edges;
}

// Whether a vertex was cut off because more than one rim runs through it.
bool CutSurface::CutPinched() {
  const std::multimap<int32_t, int32_t> edges = RimEdges();
  bool found = false;
  for (auto edge = edges.begin(); edge != edges.end(); edge = edges.upper_bound(edge->first)) {
    if (edges.count(edge->first) < 2) continue;
    Cut(edge->first);
    found = true;
  }
  return found;
}

// Whether something was cut off that hung on the rest by what is cut off.
bool CutSurface::CutIslands() {
  mesh::UnionFind pieces(surface_.num_vertices());
  std::vector<double> areas(is_cut_.size(), 0.0);  // per piece, by its lowest vertex
  for (Eigen::Index t = 0; t < surface_.num_triangles(); ++t) {
    if (!IsKept(t)) continue;
    const Eigen::Vector3i c = surface_.triangles.col(t);
    pieces.Join(c[0], c[1]);
    pieces.Join(c[0], c[2]);
  }
  for (Eigen::Index t = 0; t < surface_.num_triangles(); ++t) {
    if (!IsKept(t)) continue;
    const Eigen::Vector3i c = surface_.triangles.col(t);
    areas[pieces.Root(c[0])] += AreaOf(surface_, c);
  }
  const std::vector<int32_t> roots = mesh::ComponentRoots(surface_);
  std::vector<int32_t> largest(is_cut_.size(),
                               -1);  // piece of each component, by its lowest vertex
  for (int32_t v = 0; v < static_cast<int32_t>(roots.size()); ++v) {
    const int32_t piece = pieces.Root(v);
    int32_t& most = largest[roots[v]];
    if (is_cut_[v] == 0 && (most < 0 || areas[piece] > areas[most])) most = piece;
  }
  bool found = false;
  for (int32_t v = 0; v < static_cast<int32_t>(roots.size()); ++v) {
    if (is_cut_[v] != 0 || pieces.Root(v) == largest[roots[v]]) continue;
    Cut(v);
    found = true;
  }
  return found;
}

// The rims of the holes. Requires: one edge leaves each vertex of a rim.
std::vector<std::vector<int32_t>> CutSurface::Rims() const {
  const std::multimap<int32_t, int32_t> edges = RimEdges();
  std::set<int32_t> seen;
  std::vector<std::vector<int32_t>> rims;
  for (const auto& [from, to] : edges) {
    if (seen.contains(from)) continue;
    std::vector<int32_t>& rim = rims.emplace_back();
    for (auto edge = edges.find(from); edge != edges.end() && seen.insert(edge->first).second;
         edge = edges.find(edge->second)) {
      rim.push_back(edge->first);
    }
  }
  return rims;
}

}  // namespace liquidblend::registration
