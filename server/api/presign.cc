#include <string>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"
#include "server/access/owner_limits.h"
#include "server/api/handlers.h"
#include "server/api/store_space.h"
#include "server/api/submission.h"
#include "server/api/upload.h"
#include "server/base/errors.h"
#include "server/base/names.h"

namespace liquidblend::server {
namespace {

constexpr int kMaxFiles = 100;      // of a call
constexpr int64_t kMaxUrls = 1000;  // of an answer

absl::Status CheckFiles(const v1::PresignUploadRequest& request, const Limits& limits) {
  FieldViolations violations;
  violations.AddIf(request.files().empty() || request.files_size() > kMaxFiles, "files",
                   absl::StrCat("there must be 1 to ", kMaxFiles, ", got ", request.files_size()));
  int64_t left = limits.max_upload_bytes;
  for (int k = 0; k < request.files_size() && k < kMaxFiles; ++k) {
    const v1::PresignUploadRequest::File& file = request.files(k);
    const std::string field = absl::StrCat("files[", k, "]");
    violations.AddIf(file.size_bytes() < 0, absl::StrCat(field, ".size_bytes"),
                     absl::StrCat("must be >= 0, got ", file.size_bytes()));
    violations.AddIf(!store::IsBlobId(file.checksum()), absl::StrCat(field, ".checksum"),
                     "must be 'sha256-' and 64 hexadecimal digits, or 'xxh3-' and 32");
    if (file.size_bytes() < 0) continue;
    if (file.size_bytes() > left) return UploadTooLarge(limits, "");
    left -= file.size_bytes();
  }
  return violations.ToStatus();
}

// Before anything is asked of the store.
absl::Status CheckNumUrls(const v1::PresignUploadRequest& request, const store::BlobStore& blobs) {
  int64_t num_urls = 0;
  for (const v1::PresignUploadRequest::File& file : request.files()) {
    num_urls += blobs.NumPartUrls(file.size_bytes());
  }
  if (num_urls <= kMaxUrls) return absl::OkStatus();
  return InvalidField("files", absl::StrCat("too large for one call, which has at most ", kMaxUrls,
                                            " urls, not ", num_urls, ": ask for fewer"));
}

int64_t SumOfSizes(const v1::PresignUploadRequest& request) {
  int64_t num_bytes = 0;
  for (const v1::PresignUploadRequest::File& file : request.files()) num_bytes += file.size_bytes();
  return num_bytes;
}

// Whether the principal may store `num_bytes`, with what is under way, beside what it has.
absl::Status CheckOwnBytes(Backends& backends, int64_t num_bytes, const Caller& caller) {
  const store::OwnerCheck check = OwnerCheckOf(caller.principal, num_bytes);
  if (!check) return absl::OkStatus();
  store::pb::JobRecord job;
  SetCaller(caller, job);
  return backends.catalog.CheckOwner(job, check);
}

// Counts files that may arrive past the server for their owner, if that one is limited or all are.
// Takes back what was counted unless Keep() is called.
class Promises {
 public:
  Promises(Backends& backends, const Principal& principal)
      : tally_(backends.uploads),
        owner_(principal.name),
        is_limited_(principal.limits.max_stored_bytes > 0 || backends.limits.max_stored_bytes > 0) {
  }
  ~Promises() {
    for (const std::string& id : ids_) tally_.EndPromise(owner_, id);
  }
  Promises(const Promises&) = delete;
  Promises& operator=(const Promises&) = delete;

  absl::Status Add(const std::string& id, int64_t bytes) {
    if (!is_limited_) return absl::OkStatus();
    ids_.push_back(id);
    if (tally_.Promise(owner_, id, bytes, kUrlsLast)) return absl::OkStatus();
    return absl::ResourceExhaustedError(absl::StrCat("'", owner_, "' has asked for urls of ",
                                                     UploadTally::kMaxPromises, " files lately"));
  }
  void Keep() { ids_.clear(); }

 private:
  UploadTally& tally_;
  const std::string owner_;
  const bool is_limited_;
  std::vector<std::string> ids_;
};

// Uploads that were begun at the store. Drops them unless Keep() is called.
class BegunUploads {
 public:
  explicit BegunUploads(store::BlobStore& blobs) : blobs_(blobs) {}
  ~BegunUploads() {
    for (const store::DirectUpload& upload : uploads_) blobs_.DropUpload(upload);
  }
  BegunUploads(const BegunUploads&) = delete;
  BegunUploads& operator=(const BegunUploads&) = delete;

  void Add(const store::DirectUpload& upload) {
    store::DirectUpload& begun = uploads_.emplace_back();
    begun.id = upload.id;
    begun.multipart_id = upload.multipart_id;
  }
  void Keep() { uploads_.clear(); }

 private:
  store::BlobStore& blobs_;
  std::vector<store::DirectUpload> uploads_;  // their ids only
};

}  // namespace

absl::StatusOr<v1::PresignUploadResponse> PresignUpload(Backends& backends,
                                                        const v1::PresignUploadRequest& request,
                                                        const Caller& caller) {
  const Principal& principal = caller.principal;
  LB_RETURN_IF_ERROR(CheckFiles(request, LimitsOf(backends.limits, principal)));
  LB_RETURN_IF_ERROR(CheckNumUrls(request, backends.blobs));
  if (!request.animation_id().empty()) {
    LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("animation_id", request.animation_id()));
    LB_RETURN_IF_ERROR(CheckIsFree(backends.catalog, id));
  }
  // Reserved before it is looked at, so that calls side by side do not pass together.
  const int64_t num_bytes = SumOfSizes(request);
  const int64_t under_way = backends.uploads.Add(principal.name, num_bytes);
  const absl::Cleanup release = [&] { backends.uploads.Add(principal.name, -num_bytes); };
  LB_RETURN_IF_ERROR(CheckOwnBytes(backends, under_way, caller));
  LB_ASSIGN_OR_RETURN(const int64_t stored_bytes, StoredBytes(backends.catalog, backends.limits));
  LB_RETURN_IF_ERROR(CheckStoredBytes(backends.limits, stored_bytes, backends.uploads.Sum()));
  Promises promises(backends, principal);
  BegunUploads begun(backends.blobs);
  v1::PresignUploadResponse response;
  *response.mutable_expire_time() = store::ToTimestamp(absl::Now() + kUrlsLast);
  for (const v1::PresignUploadRequest::File& file : request.files()) {
    LB_ASSIGN_OR_RETURN(
        store::DirectUpload upload,
        backends.blobs.PresignUpload(file.checksum(), file.size_bytes(), kUrlsLast));
    begun.Add(upload);
    LB_RETURN_IF_ERROR(promises.Add(upload.id, file.size_bytes()));
    v1::PresignUploadResponse::File& to = *response.add_files();
    to.set_blob(upload.id);
    to.set_part_bytes(upload.part_bytes);
    to.set_complete_url(upload.complete_url);
    for (std::string& url : upload.part_urls) to.add_part_urls(std::move(url));
    to.mutable_headers()->insert(upload.headers.begin(), upload.headers.end());
  }
  promises.Keep();
  begun.Keep();
  return response;
}

}  // namespace liquidblend::server
