// Checks of the animations of a registration against each other and against the request.
#pragma once

#include "absl/status/status.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::server {

// Whether the animations of `job` can be registered to one another: each has two frames or more and
// some liquid, all have the source's frame rate and its direction that is up, and correspondences
// lie within their times. Cost: one query of the catalog for each animation. Animations that are
// missing or not ready are skipped: submitting the job refuses them. Errors: kInvalidArgument with
// the fields of RegisterFamilyRequest; those of the catalog.
absl::Status CheckAnimations(store::Catalog& catalog, const store::pb::RegisterJob& job);

}  // namespace liquidblend::server
