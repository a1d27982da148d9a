#include "core/store/s3_blob_store.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/blob_cache.h"
#include "core/store/blob_store.h"
#include "core/store/content_hash.h"
#include "core/store/fault_point.h"
#include "core/store/random_id.h"
#include "core/store/retry.h"
#include "core/store/s3_client.h"

namespace liquidblend::store {
namespace {

constexpr char kBlobs[] = "blobs/";
constexpr char kUploads[] = "uploads/";  // sent by clients
constexpr char kQuarantine[] = "quarantine/";
constexpr int kMaxDownloads = 2;  // of a blob that arrives damaged

std::string KeyOf(const BlobId& id) {
  return absl::StrCat(IsUploadId(id) ? kUploads : kBlobs, id.substr(5, 2), "/", id);
}

// What blobs and writers need of the store; they may outlive it.
struct Shared {
  std::unique_ptr<S3Client> s3;
  std::unique_ptr<BlobCache> cache;
};

// Collects the bytes in the cache, since their name, and so their key, is known at the end only.
class S3BlobWriter : public BlobWriter {
 public:
  S3BlobWriter(std::shared_ptr<const Shared> shared, std::unique_ptr<BlobWriter> local)
      : shared_(std::move(shared)), local_(std::move(local)) {}

  absl::Status Append(std::span<const std::byte> bytes) override { return local_->Append(bytes); }

  absl::StatusOr<BlobId> Commit() override {
    LB_ASSIGN_OR_RETURN(const BlobId id, local_->Commit());
    LB_ASSIGN_OR_RETURN(const std::shared_ptr<const Blob> blob, shared_->cache->Find(id));
    FaultPoint("blob.before_upload");
    LB_RETURN_IF_ERROR(shared_->s3->Put(KeyOf(id), blob->bytes()));
    FaultPoint("blob.after_upload");
    LB_RETURN_IF_ERROR(shared_->cache->Trim());
    return id;
  }

 private:
  const std::shared_ptr<const Shared> shared_;
  const std::unique_ptr<BlobWriter> local_;
};

// Gets a whole object, several parts at once, and tells what its bytes hash to.
absl::StatusOr<BlobId> Download(S3Client& s3, const std::string& key, int64_t size,
                                absl::FunctionRef<absl::Status(std::span<const std::byte>)> take) {
  const S3Options& options = s3.options();
  BlobHasher hasher;
  for (int64_t begin = 0; begin < size;) {
    std::vector<S3Client::Range> ranges;
    while (begin < size && ranges.size() < static_cast<size_t>(options.num_parallel)) {
      ranges.push_back({begin, std::min(options.part_bytes, size - begin)});
      begin += ranges.back().size;
    }
    LB_ASSIGN_OR_RETURN(const std::vector<std::string> parts, s3.Get(key, ranges));
    for (const std::string& part : parts) {
      const auto bytes = std::as_bytes(std::span(part.data(), part.size()));
      hasher.Add(bytes);
      LB_RETURN_IF_ERROR(take(bytes));
    }
  }
  return hasher.Id();
}

class S3BlobStore : public BlobStore {
 public:
  explicit S3BlobStore(std::shared_ptr<const Shared> shared) : shared_(std::move(shared)) {}

  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() override {
    LB_ASSIGN_OR_RETURN(std::unique_ptr<BlobWriter> local, shared_->cache->Create());
    return std::make_unique<S3BlobWriter>(shared_, std::move(local));
  }

  absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckId(id));
    const absl::StatusOr<S3Object> object = shared_->s3->Find(KeyOf(id));
    if (!object.ok() && !IsOfEnvironment(object.status())) return object.status();
    if (!IsUploadId(id)) {  // what a client has sent must be there itself
      auto cached = shared_->cache->Find(id);
      if (cached.ok() || !absl::IsNotFound(cached.status())) return cached;
    }
    if (!object.ok()) return object.status();
    for (int attempt = 1;; ++attempt) {
      const absl::Status status = Fetch(id, object->size_bytes);
      if (status.ok()) return shared_->cache->Find(ContentIdOf(id));
      if (!absl::IsDataLoss(status) || attempt == kMaxDownloads) return status;
      base::LogWarning(absl::StrCat(status.message(), "; once more"));
    }
  }

  absl::Status Verify(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckId(id));
    LB_ASSIGN_OR_RETURN(const S3Object object, shared_->s3->Find(KeyOf(id)));
    for (int attempt = 1;; ++attempt) {
      LB_ASSIGN_OR_RETURN(const BlobId found, Download(*shared_->s3, object.key, object.size_bytes,
                                                       [](auto) { return absl::OkStatus(); }));
      if (found == ContentIdOf(id)) return absl::OkStatus();
      if (attempt == kMaxDownloads) return DamageOf(object.key, object.size_bytes, found);
    }
  }

  absl::Status Delete(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckId(id));
    LB_RETURN_IF_ERROR(shared_->s3->Delete(KeyOf(id)));
    return shared_->cache->Delete(ContentIdOf(id));
  }

  absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) override {
    LB_RETURN_IF_ERROR(CheckId(id));
    LB_ASSIGN_OR_RETURN(const bool is_gone, shared_->s3->DeleteIfNotNewer(KeyOf(id), time));
    if (is_gone) LB_RETURN_IF_ERROR(shared_->cache->Delete(ContentIdOf(id)));
    return is_gone;
  }

  // By way of the cache, where it lies under the name of what it is now.
  absl::StatusOr<std::string> Quarantine(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckId(id));
    LB_ASSIGN_OR_RETURN(const S3Object object, shared_->s3->Find(KeyOf(id)));
    LB_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> writer, shared_->cache->Create());
    LB_RETURN_IF_ERROR(Download(*shared_->s3, object.key, object.size_bytes, [&](auto bytes) {
                         return writer->Append(bytes);
                       }).status());
    LB_ASSIGN_OR_RETURN(const BlobId found, writer->Commit());
    if (found == ContentIdOf(id)) {
      return absl::FailedPreconditionError(
          absl::StrCat("blob ", shared_->s3->NameOf(object.key), " is whole"));
    }
    LB_ASSIGN_OR_RETURN(const std::shared_ptr<const Blob> blob, shared_->cache->Find(found));
    const std::string aside = absl::StrCat(kQuarantine, id, "-", RandomHex(4));
    LB_RETURN_IF_ERROR(shared_->s3->Put(aside, blob->bytes()));
    // One that was put again meanwhile stays.
    LB_RETURN_IF_ERROR(shared_->s3->DeleteIfNotNewer(object.key, object.modified).status());
    return shared_->s3->NameOf(aside);
  }

  absl::StatusOr<std::vector<BlobInfo>> List() override {
    std::vector<BlobInfo> blobs;
    for (const char* const prefix : {kBlobs, kUploads}) {
      LB_RETURN_IF_ERROR(ListBelow(prefix, blobs));
    }
    return blobs;
  }

  absl::StatusOr<DirectUpload> PresignUpload(const BlobId& content, int64_t size_bytes,
                                             absl::Duration expires) override {
    if (!IsBlobId(content)) return CheckId("");
    LB_RETURN_IF_ERROR(CheckIsOffered());
    const BlobId id = absl::StrCat(content, "-", RandomHex(16));
    LB_ASSIGN_OR_RETURN(DirectUpload upload,
                        shared_->s3->PresignPut(KeyOf(id), size_bytes, expires));
    upload.id = id;
    return upload;
  }

  absl::StatusOr<std::string> PresignDownload(const BlobId& id, absl::Duration expires) override {
    LB_RETURN_IF_ERROR(CheckId(id));
    LB_RETURN_IF_ERROR(CheckIsOffered());
    LB_RETURN_IF_ERROR(shared_->s3->Find(KeyOf(id)).status());
    return shared_->s3->PresignGet(KeyOf(id), expires);
  }

  absl::StatusOr<int64_t> SizeOfUpload(const BlobId& id) override {
    if (!IsUploadId(id)) return CheckId("");
    LB_ASSIGN_OR_RETURN(const S3Object object, shared_->s3->Find(KeyOf(id)));
    return object.size_bytes;
  }

 private:
  absl::Status CheckIsOffered() const {
    if (!shared_->s3->options().client_endpoint.empty()) return absl::OkStatus();
    return absl::UnimplementedError("clients are given no urls of S3 here");
  }

  absl::Status ListBelow(const std::string& prefix, std::vector<BlobInfo>& blobs) {
    std::string token;
    do {
      LB_ASSIGN_OR_RETURN(S3Page page, shared_->s3->List(prefix, token));
      for (const S3Object& object : page.objects) {
        const std::string id = object.key.substr(object.key.rfind('/') + 1);
        if (!CheckId(id).ok() || object.key != KeyOf(id)) continue;
        blobs.push_back({id, object.size_bytes, object.modified});
      }
      token = std::move(page.next_token);
    } while (!token.empty());
    return absl::OkStatus();
  }

  static absl::Status CheckId(const BlobId& id) {
    if (IsBlobId(id) || IsUploadId(id)) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("'", id, "' is no blob id"));
  }

  absl::Status DamageOf(const std::string& key, int64_t size, const BlobId& found) const {
    return absl::DataLossError(absl::StrCat("blob ", shared_->s3->NameOf(key), " is damaged: its ",
                                            size, " bytes hash to ", found));
  }

  // Into the cache.
  absl::Status Fetch(const BlobId& id, int64_t size) {
    const std::string key = KeyOf(id);
    LB_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> writer, shared_->cache->Create());
    LB_ASSIGN_OR_RETURN(const BlobId found, Download(*shared_->s3, key, size, [&](auto bytes) {
                          return writer->Append(bytes);
                        }));
    if (found != ContentIdOf(id)) return DamageOf(key, size, found);
    LB_RETURN_IF_ERROR(writer->Commit().status());
    return shared_->cache->Trim();
  }

  const std::shared_ptr<const Shared> shared_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<BlobStore>> OpenS3BlobStore(const std::string& url,
                                                           const S3Options& options) {
  auto shared = std::make_shared<Shared>();
  LB_ASSIGN_OR_RETURN(shared->s3, S3Client::Make(url, options));
  LB_ASSIGN_OR_RETURN(shared->cache, BlobCache::Open(options.cache_directory, options.cache_bytes));
  // A wrong bucket shows now, not at the first blob.
  const absl::Status listed = shared->s3->List(kBlobs, "").status();
  if (!listed.ok() && !IsOfEnvironment(listed)) return listed;
  if (!listed.ok()) {
    base::LogWarning(absl::StrCat("opened without S3, which fails now: ", listed.ToString()));
  }
  return std::make_unique<S3BlobStore>(std::move(shared));
}

}  // namespace liquidblend::store
