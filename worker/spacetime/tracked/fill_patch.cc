#include "worker/spacetime/tracked/fill_patch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

#include "worker/spacetime/field/frame_topology.h"
#include "worker/spacetime/field/point_grid.h"

namespace liquidblend::spacetime {
namespace {

constexpr int32_t kNone = -1;

class PatchFiller {
 public:
  PatchFiller(const FramePair& pair, const FillOptions& options, PairCells& cells)
      : pair_(pair), options_(options), cells_(cells) {}

  void Fill(const std::vector<Facet>& patch) {
    const std::vector<int32_t> vertices = VerticesOf(patch);
    const AddedVertex centroid = MeanOf(vertices);
    const bool is_small = std::all_of(vertices.begin(), vertices.end(), [&](int32_t v) {
      return (HalfWay(v).position_m - centroid.position_m).norm() <= options_.cone_radius_m;
    });
    if (is_small) return AddCone(patch, centroid);
    FillByAnchors(CoverQuads(patch));
  }

 private:
  static std::vector<int32_t> VerticesOf(const std::vector<Facet>& facets) {
    std::vector<int32_t> vertices;
    for (const Facet& facet : facets) {
      vertices.insert(vertices.end(), facet.corners.begin(), facet.corners.begin() + facet.size());
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
  }

  // Where a vertex is half-way between the frames.
  AddedVertex HalfWay(int32_t v) const {
    if (v >= pair_.num_given()) return cells_.added[v - pair_.num_given()];
    const bool is_earlier = v < pair_.num_earlier();
    const mesh::TriangleMesh& frame = is_earlier ? *pair_.earlier : *pair_.later;
    const int32_t column = is_earlier ? v : v - pair_.num_earlier();
    AddedVertex vertex = {frame.vertices.col(column), Eigen::Vector3f::Zero()};
    if (frame.velocities.cols() == 0) return vertex;
    vertex.velocity = frame.velocities.col(column);
    const double step_s = is_earlier ? 0.5 * pair_.step_s : -0.5 * pair_.step_s;
    vertex.position_m += static_cast<float>(step_s) * vertex.velocity;
    return vertex;
  }

  AddedVertex MeanOf(const std::vector<int32_t>& vertices) const {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
    for (const int32_t v : vertices) {
      const AddedVertex vertex = HalfWay(v);
      position += vertex.position_m.cast<double>();
      velocity += vertex.velocity.cast<double>();
    }
    const auto count = static_cast<double>(vertices.size());
    return {(position / count).cast<float>(), (velocity / count).cast<float>()};
  }

  int32_t AddVertex(const AddedVertex& vertex) {
    cells_.added.push_back(vertex);
    return pair_.num_given() + static_cast<int32_t>(cells_.added.size()) - 1;
  }

  void AddPyramid(const Facet& quad, int32_t apex) {
    const auto& c = quad.corners;
    cells_.pyramids.push_back({c[0], c[3], c[2], c[1], apex});
  }

  void AddCone(const std::vector<Facet>& facets, const AddedVertex& centroid) {
    const int32_t apex = AddVertex(centroid);
    for (const Facet& facet : facets) {
      const auto& c = facet.corners;
      if (facet.size() == 4) {
        AddPyramid(facet, apex);
      } else {
        cells_.tetrahedra.push_back({c[0], c[2], c[1], apex});
      }
    }
  }

  // Puts a pyramid onto each quad, so that triangles are left.
  std::vector<Corners> CoverQuads(const std::vector<Facet>& patch) {
    std::vector<Corners> triangles;
    for (const Facet& facet : patch) {
      const auto& c = facet.corners;
      if (facet.size() == 3) {
        triangles.push_back({c[0], c[1], c[2]});
        continue;
      }
      const int32_t apex = AddVertex(MeanOf({c[0], c[1], c[2], c[3]}));
      AddPyramid(facet, apex);
      for (int k = 0; k < 4; ++k) triangles.push_back({c[k], c[(k + 1) % 4], apex});
    }
    return triangles;
  }

  void FillByAnchors(const std::vector<Corners>& triangles) {
    const std::map<int32_t, int32_t> anchor_of = GatherAtAnchors(triangles);
    std::map<Corners, int> coarse;  // by ascending corners: how often, less how often turned round
    for (Corners c : triangles) {
      const int sign = SortCorners(c);
      const Corners to = {anchor_of.at(c[0]), anchor_of.at(c[1]), anchor_of.at(c[2])};
      // Minus the prism operator of algebraic topology: its boundary is c less its image.
      AddTetrahedron(-sign, {c[0], to[0], to[1], to[2]});
      AddTetrahedron(sign, {c[0], c[1], to[1], to[2]});
      AddTetrahedron(-sign, {c[0], c[1], c[2], to[2]});
      if (IsDegenerate(to)) continue;
      Corners sorted = to;
      const int image_sign = sign * SortCorners(sorted);
      coarse[sorted] += image_sign;
    }
    FillCoarse(coarse);
  }

  void FillCoarse(const std::map<Corners, int>& coarse) {
    std::vector<Facet> left;
    for (const auto& [c, count] : coarse) {
      for (int n = 0; n < count; ++n) left.push_back({{c[0], c[1], c[2], kNone}});
      for (int n = 0; n < -count; ++n) left.push_back({{c[0], c[2], c[1], kNone}});
    }
    for (const std::vector<Facet>& part : SplitIntoParts(left)) {
      AddCone(part, MeanOf(VerticesOf(part)));
    }
  }

  // A tetrahedron that names a vertex twice is none.
  void AddTetrahedron(int sign, mesh::Tetrahedron cell) {
    for (int k = 0; k < 3; ++k) {
      if (std::count(cell.begin() + k, cell.end(), cell[k]) > 1) return;
    }
    if (sign < 0) std::swap(cell[0], cell[1]);
    cells_.tetrahedra.push_back(cell);
  }

  // Returns the sign of the permutation.
  static int SortCorners(Corners& c) {
    int sign = 1;
    for (const auto& [a, b] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)}) {
      if (c[a] <= c[b]) continue;
      std::swap(c[a], c[b]);
      sign = -sign;
    }
    return sign;
  }

  // Outward normals, as long as the area around; the later frame's triangles are turned round, and
  // those on quads stand on both frames.
  Eigen::Matrix3Xf NormalsOf(const std::vector<int32_t>& vertices,
                             const std::vector<Corners>& triangles) const {
    Eigen::Matrix3Xf normals = Eigen::Matrix3Xf::Zero(3, static_cast<int64_t>(vertices.size()));
    for (const Corners& c : triangles) {
      const auto is_earlier = [&](int32_t v) { return v < pair_.num_earlier(); };
      const auto num_earlier = std::count_if(c.begin(), c.end(), is_earlier);
      if (num_earlier != 0 && num_earlier != 3) continue;
      if (std::any_of(c.begin(), c.end(), [&](int32_t v) { return v >= pair_.num_given(); })) {
        continue;
      }
      const Eigen::Vector3f a = HalfWay(c[0]).position_m;
      const Eigen::Vector3f ab = HalfWay(c[1]).position_m - a;
      const Eigen::Vector3f ac = HalfWay(c[2]).position_m - a;
      const Eigen::Vector3f normal = num_earlier == 3 ? ab.cross(ac) : ac.cross(ab);
      for (const int32_t v : c) normals.col(IndexOf(vertices, v)) += normal;
    }
    return normals;
  }

  static int64_t IndexOf(const std::vector<int32_t>& ascending, int32_t v) {
    return std::lower_bound(ascending.begin(), ascending.end(), v) - ascending.begin();
  }

  // Per vertex, its anchor (added here): the closest one that faces the same way. The top of a
  // quad's pyramid goes with the quad's first corner.
  std::map<int32_t, int32_t> GatherAtAnchors(const std::vector<Corners>& triangles) {
    std::vector<int32_t> vertices;
    for (const Corners& c : triangles) vertices.insert(vertices.end(), c.begin(), c.end());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    vertices.resize(IndexOf(vertices, pair_.num_given()));
    const std::vector<int32_t> chosen_of = ChooseAnchors(vertices, NormalsOf(vertices, triangles));
    std::map<int32_t, int32_t> anchor_of;
    std::map<int32_t, int32_t> vertex_of_chosen;
    for (size_t k = 0; k < vertices.size(); ++k) {
      const auto [anchor, is_new] = vertex_of_chosen.try_emplace(chosen_of[k], kNone);
      if (is_new) anchor->second = AddVertex(HalfWay(vertices[chosen_of[k]]));
      anchor_of[vertices[k]] = anchor->second;
    }
    for (const Corners& c : triangles) {
      if (c[2] >= pair_.num_given()) anchor_of.try_emplace(c[2], anchor_of.at(c[0]));
    }
    return anchor_of;
  }

  // Per vertex, the one whose place its anchor has. One that is near no anchor becomes one.
  std::vector<int32_t> ChooseAnchors(const std::vector<int32_t>& vertices,
                                     const Eigen::Matrix3Xf& normals) const {
    Eigen::Matrix3Xf positions(3, static_cast<int64_t>(vertices.size()));
    for (size_t k = 0; k < vertices.size(); ++k) {
      positions.col(static_cast<int64_t>(k)) = HalfWay(vertices[k]).position_m;
    }
    const PointGrid grid(positions, static_cast<float>(options_.anchor_m));
    std::vector<int32_t> chosen_of(vertices.size(), kNone);
    std::vector<float> distance(vertices.size(), 0.0f);
    for (int32_t k = 0; k < static_cast<int32_t>(vertices.size()); ++k) {
      if (chosen_of[k] != kNone) continue;
      chosen_of[k] = k;
      grid.ForEachNear(positions.col(k), [&](int32_t n) {
        const float apart = (positions.col(n) - positions.col(k)).norm();
        if (normals.col(n).dot(normals.col(k)) < 0.0f) return;
        if (chosen_of[n] != kNone && distance[n] <= apart) return;
        chosen_of[n] = k;
        distance[n] = apart;
      });
    }
    return chosen_of;
  }

  const FramePair& pair_;
  const FillOptions& options_;
  PairCells& cells_;
};

}  // namespace

void FillPatch(const FramePair& pair, const std::vector<Facet>& patch, const FillOptions& options,
               PairCells& cells) {
  PatchFiller(pair, options, cells).Fill(patch);
}

}  // namespace liquidblend::spacetime
