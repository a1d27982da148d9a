// Normals of the deformed surface. Internal to worker/registration.
#pragma once

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// At vertex v of the surface that the weight times the displacements deform: by least squares over
// its neighbours, the normal of the linear map that takes the offsets to them to those of the
// deformed ones, on the side to which the map turns the source's. Zero where there is none.
Eigen::Vector4f ImageNormal(const Surface& source, const PackedLists& neighbors,
                            const Points& displacement, float weight, int64_t v);

// A column per vertex.
Points ImageNormals(const Surface& source, const PackedLists& neighbors, const Points& displacement,
                    float weight, const parallel::Arena& arena);

}  // namespace liquidblend::registration
