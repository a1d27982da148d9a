#include "core/store/blob_store.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {

bool IsBlobId(absl::string_view id) {
  constexpr absl::string_view kPrefix = "xxh3-";
  if (!absl::StartsWith(id, kPrefix) || id.size() != kPrefix.size() + 32) return false;
  return std::all_of(id.begin() + kPrefix.size(), id.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

absl::StatusOr<BlobId> PutBlob(BlobStore& blobs, std::span<const std::byte> bytes) {
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> writer, blobs.Create());
  LB_RETURN_IF_ERROR(writer->Append(bytes));
  return writer->Commit();
}

}  // namespace liquidblend::store
