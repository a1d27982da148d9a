// The cells between two frames whose triangles are linked. Internal to worker/spacetime.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/mesh/triangle_mesh.h"
#include "worker/spacetime/tracked/track_links.h"

namespace liquidblend::spacetime {

// Two successive frames. Vertices between them are numbered: those of the earlier frame, those of
// the later one, those that are added half-way in time.
struct FramePair {
  const mesh::TriangleMesh* earlier;
  const mesh::TriangleMesh* later;
  double step_s;  // between them

  int32_t num_earlier() const { return static_cast<int32_t>(earlier->num_vertices()); }
  int32_t num_given() const { return num_earlier() + static_cast<int32_t>(later->num_vertices()); }
};

struct AddedVertex {
  Eigen::Vector3f position_m;
  Eigen::Vector3f velocity;  // metres per second; 0 if not known
};

// A triangle (corners[3] = -1) or quad.
struct Facet {
  std::array<int32_t, 4> corners;
  int size() const { return corners[3] < 0 ? 3 : 4; }
};

// Cells between two frames. Together their boundary is the earlier frame less the later one.
struct PairCells {
  std::vector<mesh::Wedge> wedges;
  std::vector<mesh::Pyramid> pyramids;
  std::vector<mesh::Tetrahedron> tetrahedra;
  std::vector<AddedVertex> added;
};

// One wedge for each triangle that has a partner.
void AddWedges(const FramePair& pair, const FrameLinks& links, PairCells& cells);

// Patches: the boundary of the space between the frames without wedges, as closed, oriented
// surfaces in space-time, one for each connected part. They consist of triangles without partner
// and the sides of wedges next to them.
std::vector<std::vector<Facet>> FindPatches(const FramePair& pair, const FrameLinks& links);

// Splits facets into parts that are connected through edges, in the order of their first facets.
std::vector<std::vector<Facet>> SplitIntoParts(const std::vector<Facet>& facets);

}  // namespace liquidblend::spacetime
