#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

Surface::Surface(const mesh::SpaceTimeMesh& space_time_mesh, double edge_length_m,
                 const parallel::Arena& arena)
    : mesh(space_time_mesh),
      points(InEdgeUnits(space_time_mesh.vertices, edge_length_m)),
      cells_around(CellsAroundVertices(space_time_mesh, arena)),
      rigid(mesh::RigidVertices(space_time_mesh)) {}

std::vector<int32_t> Surface::FreeVertices() const {
  std::vector<int32_t> vertices;
  for (int32_t v = 0; v < points.cols(); ++v) {
    if (!rigid[v]) vertices.push_back(v);
  }
  return vertices;
}

}  // namespace liquidblend::registration
