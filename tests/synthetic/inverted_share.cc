#include "tests/synthetic/inverted_share.h"

#include <algorithm>
#include <cmath>

#include "worker/registration/axis_rays.h"

namespace liquidblend::synthetic {
namespace {

// Of the spacing: the first rays lie this far inside, on no plane that a vertex is likely to be on.
constexpr double kOffset = 0.3719;

registration::RayGrid RaysThrough(const mesh::TriangleMesh& surface, int axis, double spacing_m) {
  const Eigen::Vector3d low = surface.vertices.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d high = surface.vertices.rowwise().maxCoeff().cast<double>();
  registration::RayGrid grid;
  grid.axis = axis;
  grid.spacing_m = spacing_m;
  for (int k = 0; k < 2; ++k) {
    const int across = (axis + 1 + k) % 3;
    grid.first_m[k] = low[across] + kOffset * spacing_m;
    grid.counts[k] = 1 + static_cast<int>(std::floor((high[across] - low[across]) / spacing_m));
  }
  return grid;
}

}  // namespace

CrossingCount CountInverted(const mesh::TriangleMesh& surface, double spacing_m) {
  CrossingCount count;
  if (surface.num_triangles() == 0) return count;
  for (const int axis : {0, 2}) {
    const registration::RayGrid grid = RaysThrough(surface, axis, spacing_m);
    const registration::AxisRays rays(surface, grid);
    for (int v = 0; v < grid.counts[1]; ++v) {
      for (int u = 0; u < grid.counts[0]; ++u) {
        int winding = 0;
        for (const registration::Crossing& crossing : rays.Crossings(u, v)) {
          const int before = winding;
          winding += crossing.step;
          ++count.num_crossings;
          count.num_inverted += std::min(before, winding) < 0 ? 1 : 0;
        }
      }
    }
  }
  return count;
}

}  // namespace liquidblend::synthetic
