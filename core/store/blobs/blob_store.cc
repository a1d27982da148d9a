#include "core/store/blobs/blob_store.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {

namespace {

struct IdForm {
  absl::string_view prefix;
  size_t num_digits;
};
constexpr IdForm kForms[] = {{"sha256-", 64}, {"xxh3-", 32}};
constexpr size_t kNumUploadDigits = 32;

bool IsHex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

// The length of the blob id at the beginning of the text; 0 if there is none.
size_t IdLength(absl::string_view text) {
  for (const IdForm& form : kForms) {
    const size_t length = form.prefix.size() + form.num_digits;
    if (absl::StartsWith(text, form.prefix) && text.size() >= length &&
        IsHex(text.substr(form.prefix.size(), form.num_digits))) {
      return length;
    }
  }
  return 0;
}

absl::Status NoUrls() {
  return absl::UnimplementedError("the store gives no urls to send to or get from");
}

}  // namespace

bool IsBlobId(absl::string_view id) { return !id.empty() && IdLength(id) == id.size(); }

bool IsUploadId(absl::string_view id) {
  const size_t length = IdLength(id);
  return length > 0 && id.size() == length + 1 + kNumUploadDigits && id[length] == '-' &&
         IsHex(id.substr(length + 1));
}

BlobId ContentIdOf(absl::string_view id) { return BlobId(id.substr(0, IdLength(id))); }

std::string BlobKey(const BlobId& id) {
  const size_t digits = id.find('-') + 1;
  return absl::StrCat(IsUploadId(id) ? "uploads/" : "blobs/", id.substr(digits, 2), "/", id);
}

absl::Status CheckBlobId(absl::string_view id) {
  if (IsBlobId(id) || IsUploadId(id)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("'", id, "' is not a blob id"));
}

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

absl::Status PutBlobAs(BlobStore& blobs, const BlobId& id, std::span<const std::byte> bytes) {
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> writer, blobs.CreateAs(id));
  LB_RETURN_IF_ERROR(writer->Append(bytes));
  return writer->Commit().status();
}

}  // namespace liquidblend::store
