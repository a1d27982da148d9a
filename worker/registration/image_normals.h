// Normals of the deformed surface. Internal to worker/registration.
#pragma once

#include "worker/registration/match.h"

namespace liquidblend::registration {

// Of each vertex: by least squares over its neighbours, the normal of the linear map that takes the
// offsets to them to those of the deformed ones. On the side of the source's normal as the map
// turns it; zero where there is none.
Points ImageNormals(const Surface& source, const IndexLists& neighbors, const Points& displacement,
                    const parallel::Arena& arena);

}  // namespace liquidblend::registration
