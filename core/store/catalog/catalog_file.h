// Catalog file: all records of a catalog, for a move to another store (docs/formats.md, "Export").
#pragma once

#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog_upkeep.h"
#include "google/protobuf/message.h"

namespace liquidblend::store {

// Writes all records to a catalog file.
//   store  name of the store that they come from
//   time   when they were read
// Errors: the writer's.
absl::Status WriteCatalogFile(const CatalogContents& contents, const std::string& store,
                              absl::Time time, BlobWriter& out);

// Reads a catalog file. Errors: kDataLoss if the file is damaged, kInvalidArgument if it has
// another type or an unknown version; messages begin with `name`.
absl::StatusOr<CatalogContents> ReadCatalogFile(std::span<const std::byte> bytes,
                                                const std::string& name);

// All blob ids in a record, in any field.
std::vector<BlobId> BlobIdsIn(const google::protobuf::Message& record);

// Whether the blob of an animation's record must exist: it has one, and the animation did not fail.
inline bool NeedsBlob(const pb::AnimationRecord& animation) {
  return animation.state() != pb::AnimationRecord::FAILED && !animation.blob().empty();
}

}  // namespace liquidblend::store
