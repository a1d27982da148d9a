// Loaded family: one version of a family in memory, with the indices for making frames.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/frames/indexed_family.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::catalog {

// One version of a family, with its indices and its file.  Threads: safe, immutable.
struct LoadedFamily : frames::IndexedFamily {
  using IndexedFamily::IndexedFamily;       // of a family with name and version as in the catalog
  std::shared_ptr<const store::Blob> file;  // that `family` views; null: it views other memory
  // kDataLoss once a part of the file could not be read: frames made since then are not to be sent.
  absl::Status CheckFile() const;
  int64_t size_bytes = 0;  // mapped file, indices and links
  // Id, version and content: families with equal generations give the same frames.
  std::string generation;
};
using FamilyPtr = std::shared_ptr<const LoadedFamily>;

// The generation of a record's family.
std::string GenerationOf(const store::pb::FamilyRecord& record);

// Errors: kDataLoss if the blob is missing or not a family file; the blob store's. Messages begin
// with the family's name.
absl::StatusOr<FamilyPtr> LoadFamily(const store::pb::FamilyRecord& record,
                                     store::BlobStore& blobs);

}  // namespace liquidblend::catalog
