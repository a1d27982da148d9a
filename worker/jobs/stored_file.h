// Writing of results into the store.
#pragma once

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/registered_family.h"
#include "core/store/blobs/blob_store.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::jobs {

// Writes the animation's file and returns the record to publish.
// Errors: those of the store.
absl::StatusOr<store::v1::AnimationRecord> StoreAnimation(const mesh::Animation& animation,
                                                          store::BlobStore& blobs);

// Likewise for a family. Requires: Validate(family).ok().
absl::StatusOr<store::v1::FamilyRecord> StoreFamily(const mesh::RegisteredFamily& family,
                                                    store::BlobStore& blobs);

}  // namespace liquidblend::jobs
