// Corner table of a closed surface: the neighbours of each triangle across its edges (Rossignac,
// Safonova, Szymczak, "3D compression made simple: Edgebreaker on a corner table", 2001).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/parallel/helpers.h"

namespace liquidblend::encode {

// Corner table. A corner is 4 * triangle + k, k in {0, 1, 2}. Keeps its memory from one mesh to the
// next.
class CornerTable {
 public:
  static int32_t TriangleOf(int32_t corner) { return corner >> 2; }
  // The next and the previous corner of the triangle. Without branches, which could not be
  // predicted.
  static int32_t Next(int32_t corner) { return corner + 1 - 3 * ((corner >> 1) & 1); }
  static int32_t Previous(int32_t corner) { return corner + 2 - 3 * (((corner & 3) + 3) >> 2); }

  // Builds the table of a mesh. Triangles that name a vertex twice are left out, the others keep
  // their order. At a non-manifold edge, of four triangles or more, two each become neighbours; a
  // vertex with several fans of triangles becomes several. Returns false, with nothing to be read,
  // if the surface is not closed and oriented (an edge is run through more often in one direction
  // than in the other) or has 2^28 triangles.
  //   helpers  idle threads that may help, or null; the result does not depend on them
  // Requires: mesh passed Validate() and stays while the table is used.  Cost: O(triangles) for
  // bounded valences.
  bool Build(const mesh::TriangleMesh& mesh, parallel::Helpers* helpers = nullptr);

  int32_t num_triangles() const { return num_triangles_; }
  // The mesh's vertices, then those that were split off.
  int32_t num_vertices() const { return static_cast<int32_t>(valences_.size()); }
  int32_t num_used_vertices() const { return num_used_vertices_; }

  int32_t VertexOf(int32_t corner) const { return vertices_[Place(corner)]; }
  // The corner that faces the same edge from the neighbouring triangle, for the edge from this
  // corner to the previous one. The next corner faces that edge here.
  int32_t RightOf(int32_t corner) const { return right_[Place(corner)]; }
  // The same for the edge from this corner to the next one.
  int32_t LeftOf(int32_t corner) const { return RightOf(Next(corner)); }
  // The same for the edge that this corner faces.
  int32_t Opposite(int32_t corner) const { return RightOf(Previous(corner)); }

  // Fetches the numbers of a corner's triangle from memory ahead of their use.
  void Prefetch(int32_t corner) const {
    __builtin_prefetch(&vertices_[Place(corner)]);
    __builtin_prefetch(&right_[Place(corner)]);
  }

  // Per vertex the number of its triangles; 0 for those of no triangle.
  const std::vector<int32_t>& valences() const { return valences_; }
  // The mesh's vertex that each one beyond the mesh's own was split off.
  const std::vector<int32_t>& split_parents() const { return split_parents_; }

 private:
  static constexpr int32_t kPerBlock = 8;
  // Some of a vertex's triangles in a cache line: for each the vertex before it and the corner
  // after it.
  struct alignas(64) Block {
    std::array<uint32_t, kPerBlock> vertices;
    std::array<int32_t, kPerBlock> corners;
  };

  // Scratch for linking the triangles around vertices, one vertex after the other.
  struct Linker {
    int32_t num_used_vertices = 0;
    bool is_closed = true;
    std::vector<int32_t> unsplit;           // vertices that may have several fans
    std::vector<uint32_t> around_vertices;  // of one vertex: all of its blocks
    std::vector<int32_t> around_corners;
    std::vector<uint64_t> edges_out, edges_in;
  };

  // Place of a corner's numbers in arrays with three for each triangle.
  static int32_t Place(int32_t corner) { return corner - TriangleOf(corner); }

  void Reset(const mesh::TriangleMesh& mesh);
  bool ListCorners();
  void CopyTriangles(bool leave_out_degenerate);
  int32_t BlockFor(int32_t vertex, int32_t number);
  bool LinkAll(parallel::Helpers* helpers);
  void LinkSome(int32_t begin, int32_t end, Linker& linker);
  bool LinkAround(int32_t vertex, Linker& linker);
  template <int kMaxValence>
  bool LinkFan(const uint32_t* vertices, const int32_t* corners, int valence);
  bool LinkMany(int32_t vertex, Linker& linker);
  void Collect(int32_t vertex, Linker& linker) const;
  int32_t FanSize(int32_t corner) const;
  void SplitFans(int32_t vertex);

  const int32_t* vertices_ = nullptr;  // of the corners: the mesh's own, or the copy
  std::vector<int32_t> copy_;
  std::vector<int32_t> right_;  // RightOf() the corners
  std::vector<int32_t> valences_;
  std::vector<int32_t> split_parents_;
  int32_t num_triangles_ = 0;
  int32_t num_used_vertices_ = 0;

  std::vector<Block> blocks_;  // one per vertex of the mesh, then further ones
  // Links between the blocks of a vertex: from its first block to its last one, from there to the
  // one before and so on. The second block's link is not set.
  std::vector<int32_t> block_links_;
  int32_t num_blocks_ = 0;
  std::vector<Linker> linkers_;
};

}  // namespace liquidblend::encode
