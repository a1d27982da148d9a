// Requests to refine a family's registration.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::server {

// The version to refine; fills in source, targets, points in parameter space, their interpolation
// and time blending where the request leaves them out. Errors: kNotFound; kFailedPrecondition if no
// version of the family is finished; kInvalidArgument if the request names other animations, with
// both. Requires: family_id is an id, source and targets are names.
absl::StatusOr<int64_t> CompleteRefinement(store::Catalog& catalog,
                                           v1::RegisterFamilyRequest& request);

}  // namespace liquidblend::server
