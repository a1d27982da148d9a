// Points in parameter space <-> their messages in jobs and manifests.
#pragma once

#include "core/mesh/parameter_space.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

liquidblend::store::v1::ParameterSpace ToMessage(const mesh::ParameterSpace& space);
// As it is: mesh::Validate() tells whether it is good.
mesh::ParameterSpace FromMessage(const liquidblend::store::v1::ParameterSpace& message);

}  // namespace liquidblend::store
