// Which triangle lies across each edge of a closed surface: a corner table (Rossignac, Safonova,
// Szymczak, "3D compression made simple: Edgebreaker on a corner table", 2001).
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::encode {

// A corner is 8 * triangle + k, k in {0, 1, 2}. Keeps its memory from one mesh to the next.
class CornerTable {
 public:
  static int32_t TriangleOf(int32_t corner) { return corner >> 3; }
  static int32_t Next(int32_t corner) { return corner + ((corner & 2) != 0 ? -2 : 1); }
  static int32_t Previous(int32_t corner) { return corner + ((corner & 3) == 0 ? 2 : -1); }

  // Triangles that name a vertex twice are left out, the others keep their order. Of four triangles
  // or more at an edge two each become neighbours; a vertex with several fans of triangles becomes
  // several. Returns false, with nothing to be read, if the surface is not closed and oriented (an
  // edge is run through more often in one direction than in the other) or has 2^27 triangles.
  // Requires: mesh passed Validate().  Cost: O(triangles) for bounded valences.
  bool Build(const mesh::TriangleMesh& mesh);

  int32_t num_triangles() const { return num_triangles_; }
  // The mesh's vertices, then those that were split off.
  int32_t num_vertices() const { return static_cast<int32_t>(valences_.size()); }
  int32_t num_used_vertices() const { return num_used_vertices_; }

  int32_t VertexOf(int32_t corner) const { return table_[corner]; }
  // The corner beyond the edge that faces this one.
  int32_t Opposite(int32_t corner) const { return table_[corner + 4]; }
  int32_t RightOf(int32_t corner) const { return Opposite(Next(corner)); }
  int32_t LeftOf(int32_t corner) const { return Opposite(Previous(corner)); }

  // Per vertex the number of its triangles; 0 for those of no triangle.
  const std::vector<int32_t>& valences() const { return valences_; }
  // The mesh's vertex that each one beyond the mesh's own was split off.
  const std::vector<int32_t>& split_parents() const { return split_parents_; }

 private:
  // Edges of a vertex to vertices of higher numbers: a cache line, and more if they do not fit.
  static constexpr int kEdgesPerBlock = 8;
  struct alignas(64) EdgeBlock {
    std::array<uint32_t, kEdgesPerBlock> far_vertex;
    // Twice the corner that faces the edge and waits for its opposite, + 1 if it sees the edge from
    // the higher vertex to the lower one; or kNone.
    std::array<int32_t, kEdgesPerBlock> waiting;
  };

  void Reset(const mesh::TriangleMesh& mesh);
  void AddTriangle(const std::array<int32_t, 3>& vertices);
  void LinkCorner(int32_t corner, int32_t from, int32_t to);
  std::pair<int32_t, uint32_t> FindEdge(int32_t near, uint32_t far) const;
  bool LinkCrowded();
  int32_t FanSize(int32_t corner) const;
  void SplitFans();
  void SplitOffFan(int32_t corner);

  std::vector<int32_t> table_;  // per triangle three vertices, -, three opposite corners, -
  std::vector<int32_t> valences_;
  std::vector<int32_t> split_parents_;
  int32_t num_triangles_ = 0;
  int32_t num_used_vertices_ = 0;

  std::vector<EdgeBlock> blocks_;       // one per vertex, then those that are linked to
  std::vector<uint8_t> num_edges_;      // per block
  std::vector<int32_t> next_block_;     // per block; kNone
  std::vector<int32_t> crowded_;        // corners whose edge had one waiting in their direction
  std::vector<int32_t> vertex_corner_;  // per vertex one of its corners
  int64_t num_waiting_ = 0;
};

}  // namespace liquidblend::encode
