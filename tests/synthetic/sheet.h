// Sheets of liquid with a rim: thin, closed, in one piece and without a hole.
#pragma once

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::synthetic {

struct SheetOptions {
  double radius_m = 1.0;     // > 0; along the sheet
  double thickness_m = 0.1;  // > 0
  double edge_m = 0.1;       // > 0; about the mean edge length
  double bend_m = 0.0;       // radius of the sphere that it is a cap of; 0: flat
};

// A disc around the z axis, its middle at the origin, its top towards +z; or a cap of a spherical
// shell that bends towards -z. The rim is cut square.
mesh::TriangleMesh Sheet(const SheetOptions& options);

}  // namespace liquidblend::synthetic
