// liquidblend's file formats (docs/formats.md): animation files and family files.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/registered_family.h"
#include "core/store/blob_store.h"
#include "liquidblend/store/v1/files.pb.h"

namespace liquidblend::store {

// Writes an animation as one file of aligned, checksummed sections.
absl::Status WriteAnimation(const mesh::Animation& animation, BlobWriter& out);

// Errors: kDataLoss with the section at fault; kInvalidArgument if it is no animation file.
absl::StatusOr<mesh::Animation> ReadAnimation(const Blob& blob, const std::string& name);

// Writes a registered family; family.version is not stored in the file (the catalog assigns it).
// Requires: Validate(family).ok().
absl::Status WriteFamily(const mesh::RegisteredFamily& family, BlobWriter& out);

// A view on the blob, which it keeps alive; checks header, sections, checksums and Validate().
absl::StatusOr<mesh::RegisteredFamily> OpenFamily(std::shared_ptr<const Blob> blob,
                                                  const std::string& name);

// What stands in the catalog about them (no sections).
liquidblend::store::v1::AnimationManifest ManifestOf(const mesh::Animation& animation);
liquidblend::store::v1::FamilyManifest ManifestOf(const mesh::RegisteredFamily& family);

}  // namespace liquidblend::store
