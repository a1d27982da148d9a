// Rotation of meshes and boxes so that z is up, for pictures.
#pragma once

#include "liquidblend/bounds.h"
#include "liquidblend/mesh.h"
#include "liquidblend/up.h"

namespace liquidblend::render {

// Exact: coordinates change their places and signs. With y up, x goes to the right and the picture
// is taken along -z. kUnknown: unchanged.
Mesh Upright(Mesh mesh, Up up);
Bounds Upright(const Bounds& bounds, Up up);

}  // namespace liquidblend::render
