// Points in parameter space <-> their messages in jobs and manifests.
#pragma once

#include "core/mesh/parameter_space.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

// Leaves linear interpolation out: files of such families have the bytes that they always had.
liquidblend::store::v1::ParameterSpace ToMessage(const mesh::ParameterSpace& space);
// Converts without a check; mesh::Validate() checks the result.
mesh::ParameterSpace FromMessage(const liquidblend::store::v1::ParameterSpace& message);

}  // namespace liquidblend::store
