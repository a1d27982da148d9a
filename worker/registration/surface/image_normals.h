// Normals of the deformed surface. Internal to worker/registration.
#pragma once

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Normal at vertex v of the surface deformed by weight times the displacements. A linear map of the
// tangent space is fitted by least squares to the offsets of v's neighbours before and after the
// deformation. The result is the unit normal of its image, on the side of the source's normal; zero
// where the map is singular.
Eigen::Vector4f ImageNormal(const Surface& source, const PackedLists& neighbors,
                            const Points& displacement, float weight, int64_t v);

// Image normals of all vertices, a column each.
Points ImageNormals(const Surface& source, const PackedLists& neighbors, const Points& displacement,
                    float weight, const parallel::Arena& arena);

}  // namespace liquidblend::registration
