#include "core/store/blob_store.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {

namespace {

constexpr absl::string_view kPrefix = "xxh3-";
constexpr size_t kNumDigits = 32;
constexpr size_t kIdLength = kPrefix.size() + kNumDigits;

bool IsHex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

absl::Status NoUrls() {
  return absl::UnimplementedError("the store gives no urls to send to or get from");
}

}  // namespace

bool IsBlobId(absl::string_view id) {
  return absl::StartsWith(id, kPrefix) && id.size() == kIdLength &&
         IsHex(id.substr(kPrefix.size()));
}

bool IsUploadId(absl::string_view id) {
  return id.size() == kIdLength + 1 + kNumDigits && IsBlobId(id.substr(0, kIdLength)) &&
         id[kIdLength] == '-' && IsHex(id.substr(kIdLength + 1));
}

BlobId ContentIdOf(absl::string_view id) { return BlobId(id.substr(0, kIdLength)); }

absl::StatusOr<DirectUpload> BlobStore::PresignUpload(const BlobId&, int64_t, absl::Duration) {
  return NoUrls();
}
absl::StatusOr<std::string> BlobStore::PresignDownload(const BlobId&, absl::Duration) {
  return NoUrls();
}
absl::StatusOr<int64_t> BlobStore::SizeOfUpload(const BlobId&) { return NoUrls(); }

absl::StatusOr<BlobId> PutBlob(BlobStore& blobs, std::span<const std::byte> bytes) {
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> writer, blobs.Create());
  LB_RETURN_IF_ERROR(writer->Append(bytes));
  return writer->Commit();
}

}  // namespace liquidblend::store
