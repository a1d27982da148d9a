#include "core/store/blobs/s3_blob_store.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault_point.h"
#include "core/base/log.h"
#include "core/base/random_id.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/blob_cache.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/blobs/new_blob_name.h"
#include "core/store/blobs/s3_client.h"

namespace liquidblend::store {
namespace {

constexpr char kBlobs[] = "blobs/";
constexpr char kUploads[] = "uploads/";
constexpr char kQuarantine[] = "quarantine/";
constexpr char kCatalogId[] = "catalog-id";
constexpr int kMaxDownloads = 2;     // of a blob that arrives damaged
constexpr int kMaxEmptyPages = 100;  // of a list, one after another

// Parts of the store that blobs and writers use; they may outlive the store.
struct Shared {
  std::unique_ptr<S3Client> s3;
  std::unique_ptr<BlobCache> cache;
};

// Gets a whole object, several parts at once.
absl::Status Download(S3Client& s3, const std::string& key, int64_t size,
                      absl::FunctionRef<absl::Status(std::span<const std::byte>)> take) {
  const S3Options& options = s3.options();
  for (int64_t begin = 0; begin < size;) {
    std::vector<S3Client::Range> ranges;
    while (begin < size && ranges.size() < static_cast<size_t>(options.num_parallel)) {
      ranges.push_back({begin, std::min(options.part_bytes, size - begin)});
      begin += ranges.back().size;
    }
    LB_ASSIGN_OR_RETURN(const std::vector<std::string> parts, s3.Get(key, ranges));
    for (const std::string& part : parts) {
      LB_RETURN_IF_ERROR(take(std::as_bytes(std::span(part.data(), part.size()))));
    }
  }
  return absl::OkStatus();
}

// Checks that the object of this id, if there is one, has no other bytes with the same hash. Only
// ids of XXH3 need this check. Errors: kAlreadyExists if it has.
absl::Status CheckNoCollision(S3Client& s3, const BlobId& id, std::span<const std::byte> bytes) {
  const absl::StatusOr<S3Object> object = s3.Find(BlobKey(id));
  if (absl::IsNotFound(object.status())) return absl::OkStatus();
  LB_RETURN_IF_ERROR(object.status());
  BlobHasher named(HashKindOf(id)), there, ours;
  LB_RETURN_IF_ERROR(
      Download(s3, object->key, object->size_bytes, [&](std::span<const std::byte> part) {
        named.Add(part);
        there.Add(part);
        return absl::OkStatus();
      }));
  ours.Add(bytes);
  if (there.Id() == ours.Id() || named.Id() != ContentIdOf(id)) return absl::OkStatus();
  return absl::AlreadyExistsError(
      absl::StrCat("blob ", s3.NameOf(object->key), " has other content with the same hash"));
}

// Writer of a blob. It collects the bytes in the cache, since their name, and so their key, is
// known at the end only.
class S3BlobWriter : public BlobWriter {
 public:
  S3BlobWriter(std::shared_ptr<const Shared> shared, std::unique_ptr<BlobWriter> local,
               NewBlobName name)
      : shared_(std::move(shared)), local_(std::move(local)), name_(std::move(name)) {}

  absl::Status Append(std::span<const std::byte> bytes) override { return local_->Append(bytes); }

  // An object of the same SHA-256 is replaced by the same bytes, which renews its age.
  absl::StatusOr<BlobId> Commit() override {
    LB_ASSIGN_OR_RETURN(const BlobId content, local_->Commit());
    LB_ASSIGN_OR_RETURN(const std::shared_ptr<const Blob> blob, shared_->cache->Find(content));
    BlobId id = name_.id.empty() ? content : name_.id;
    if (name_.is_upload) absl::StrAppend(&id, "-", base::RandomHex(16));
    if (HashKindOf(id) != HashKind::kSha256) {
      const absl::Status compared = CheckNoCollision(*shared_->s3, id, blob->bytes());
      if (!compared.ok()) shared_->cache->Delete(content).IgnoreError();
      LB_RETURN_IF_ERROR(compared);
    }
    base::FaultPoint("blob.before_upload");
    LB_RETURN_IF_ERROR(shared_->s3->Put(BlobKey(id), blob->bytes()));
    base::FaultPoint("blob.after_upload");
    LB_RETURN_IF_ERROR(blob->Check());  // fails if zeros were sent
    LB_RETURN_IF_ERROR(shared_->cache->Trim());
    return id;
  }

 private:
  const std::shared_ptr<const Shared> shared_;
  const std::unique_ptr<BlobWriter> local_;
  const NewBlobName name_;
};

class S3BlobStore : public BlobStore {
 public:
  explicit S3BlobStore(std::shared_ptr<const Shared> shared) : shared_(std::move(shared)) {}

  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() override {
    LB_ASSIGN_OR_RETURN(std::unique_ptr<BlobWriter> local, shared_->cache->Create());
    return std::make_unique<S3BlobWriter>(shared_, std::move(local), NewBlobName());
  }

  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    if (!IsCachedByName(id)) {
      return absl::InvalidArgumentError(absl::StrCat("'", id, "' is of an older client's upload"));
    }
    LB_ASSIGN_OR_RETURN(std::unique_ptr<BlobWriter> local,
                        shared_->cache->CreateAs(ContentIdOf(id)));
    return std::make_unique<S3BlobWriter>(shared_, std::move(local), NewBlobName{.id = id});
  }

  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateUpload() override {
    LB_ASSIGN_OR_RETURN(std::unique_ptr<BlobWriter> local, shared_->cache->Create());
    return std::make_unique<S3BlobWriter>(shared_, std::move(local),
                                          NewBlobName{.id = "", .is_upload = true});
  }

  absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    const absl::StatusOr<S3Object> object = shared_->s3->Find(BlobKey(id));
    const bool is_away = base::IsTransient(object.status());
    // The object of an upload must be there itself.
    if (!object.ok() && (!is_away || IsUploadId(id))) return object.status();
    if (IsCachedByName(id)) {
      auto cached = shared_->cache->Find(ContentIdOf(id));
      if (cached.ok() || !absl::IsNotFound(cached.status())) return cached;
    }
    if (!object.ok()) return object.status();
    for (int attempt = 1;; ++attempt) {
      absl::StatusOr<std::shared_ptr<const Blob>> blob = Fetch(id, object->size_bytes);
      if (!absl::IsDataLoss(blob.status()) || attempt == kMaxDownloads) return blob;
      base::LogWarning(absl::StrCat(blob.status().message(), "; fetching it again"));
    }
  }

  absl::Status Verify(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    LB_ASSIGN_OR_RETURN(const S3Object object, shared_->s3->Find(BlobKey(id)));
    for (int attempt = 1;; ++attempt) {
      BlobHasher hasher(HashKindOf(id));
      LB_RETURN_IF_ERROR(Download(*shared_->s3, object.key, object.size_bytes, [&](auto bytes) {
        hasher.Add(bytes);
        return absl::OkStatus();
      }));
      if (hasher.Id() == ContentIdOf(id)) return absl::OkStatus();
      if (attempt == kMaxDownloads) return DamageOf(object.key, object.size_bytes, hasher.Id());
    }
  }

  absl::Status Delete(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    LB_RETURN_IF_ERROR(shared_->s3->Delete(BlobKey(id)));
    return Forget(id);
  }

  absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    LB_ASSIGN_OR_RETURN(const bool is_gone, shared_->s3->DeleteIfNotNewer(BlobKey(id), time));
    if (is_gone) LB_RETURN_IF_ERROR(Forget(id));
    return is_gone;
  }

  // Copies the object through the cache, where it has the name of its actual content.
  absl::StatusOr<std::string> Quarantine(const BlobId& id) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    LB_ASSIGN_OR_RETURN(const S3Object object, shared_->s3->Find(BlobKey(id)));
    LB_ASSIGN_OR_RETURN(const std::unique_ptr<BlobWriter> writer, shared_->cache->Create());
    BlobHasher named(HashKindOf(id));
    LB_RETURN_IF_ERROR(Download(*shared_->s3, object.key, object.size_bytes, [&](auto bytes) {
      named.Add(bytes);
      return writer->Append(bytes);
    }));
    if (named.Id() == ContentIdOf(id)) {
      return absl::FailedPreconditionError(
          absl::StrCat("blob ", shared_->s3->NameOf(object.key), " is whole"));
    }
    LB_ASSIGN_OR_RETURN(const BlobId found, writer->Commit());
    LB_ASSIGN_OR_RETURN(const std::shared_ptr<const Blob> blob, shared_->cache->Find(found));
    const std::string aside = absl::StrCat(kQuarantine, id, "-", base::RandomHex(4));
    LB_RETURN_IF_ERROR(shared_->s3->Put(aside, blob->bytes()));
    // A blob that was written again meanwhile stays.
    LB_RETURN_IF_ERROR(shared_->s3->DeleteIfNotNewer(object.key, object.modified).status());
    return shared_->s3->NameOf(aside);
  }

  absl::StatusOr<std::vector<BlobInfo>> List() override {
    std::vector<BlobInfo> blobs, uploads;
    LB_RETURN_IF_ERROR(ListBelow(kBlobs, blobs));
    LB_RETURN_IF_ERROR(ListBelow(kUploads, uploads));
    blobs.insert(blobs.end(), uploads.begin(), uploads.end());
    return blobs;
  }

  absl::StatusOr<std::string> ReadCatalogId() override {
    const absl::StatusOr<S3Object> object = shared_->s3->Find(kCatalogId);
    if (absl::IsNotFound(object.status())) return std::string();
    LB_RETURN_IF_ERROR(object.status());
    if (object->size_bytes == 0 || object->size_bytes > kMaxCatalogIdBytes) {
      return absl::DataLossError(absl::StrCat(shared_->s3->NameOf(kCatalogId), " has ",
                                              object->size_bytes, " bytes, which is no id"));
    }
    const S3Client::Range whole = {0, object->size_bytes};
    LB_ASSIGN_OR_RETURN(const std::vector<std::string> parts,
                        shared_->s3->Get(kCatalogId, {&whole, 1}));
    return parts[0];
  }

  absl::Status WriteCatalogId(const std::string& id) override {
    return shared_->s3->Put(kCatalogId, std::as_bytes(std::span(id.data(), id.size())));
  }

  absl::StatusOr<DirectUpload> PresignUpload(const BlobId& content, int64_t size_bytes,
                                             absl::Duration expires) override {
    if (!IsBlobId(content)) return CheckBlobId("");
    LB_RETURN_IF_ERROR(CheckIsOffered());
    const BlobId id = absl::StrCat(content, "-", base::RandomHex(16));
    LB_ASSIGN_OR_RETURN(DirectUpload upload,
                        shared_->s3->PresignPut(BlobKey(id), size_bytes, expires));
    upload.id = id;
    return upload;
  }

  int64_t NumPartUrls(int64_t size_bytes) const override {
    return shared_->s3->NumPartUrls(size_bytes);
  }

  void DropUpload(const DirectUpload& upload) override {
    if (upload.multipart_id.empty()) return;
    shared_->s3->DropUpload(BlobKey(upload.id), upload.multipart_id);
  }

  absl::StatusOr<int64_t> DropOldUploads(absl::Time time) override {
    int64_t num_dropped = 0;
    for (const char* prefix : {kBlobs, kUploads, kQuarantine}) {
      LB_ASSIGN_OR_RETURN(const int64_t num, shared_->s3->DropOldUploads(prefix, time));
      num_dropped += num;
    }
    return num_dropped;
  }

  absl::StatusOr<std::string> PresignDownload(const BlobId& id, absl::Duration expires) override {
    LB_RETURN_IF_ERROR(CheckBlobId(id));
    LB_RETURN_IF_ERROR(CheckIsOffered());
    LB_RETURN_IF_ERROR(shared_->s3->Find(BlobKey(id)).status());
    return shared_->s3->PresignGet(BlobKey(id), expires);
  }

  absl::StatusOr<int64_t> SizeOfUpload(const BlobId& id) override {
    if (!IsUploadId(id)) return CheckBlobId("");
    LB_ASSIGN_OR_RETURN(const S3Object object, shared_->s3->Find(BlobKey(id)));
    return object.size_bytes;
  }

  absl::Status MakeRoom(int64_t free_bytes) override {
    return shared_->cache->MakeRoom(free_bytes);
  }

 private:
  absl::Status CheckIsOffered() const {
    if (!shared_->s3->options().client_endpoint.empty()) return absl::OkStatus();
    return absl::UnimplementedError("clients are given no urls of S3 here");
  }

  absl::Status ListBelow(const std::string& prefix, std::vector<BlobInfo>& blobs) {
    std::string token, last_key;
    int num_empty = 0;
    do {
      LB_ASSIGN_OR_RETURN(S3Page page, shared_->s3->List(prefix, token));
      num_empty = page.objects.empty() ? num_empty + 1 : 0;
      if (num_empty > kMaxEmptyPages) return BadList(prefix, "too many empty pages");
      for (const S3Object& object : page.objects) {
        if (object.key <= last_key) return BadList(prefix, "its keys do not ascend");
        last_key = object.key;
        const std::string id = object.key.substr(object.key.rfind('/') + 1);
        if (!CheckBlobId(id).ok() || object.key != BlobKey(id)) continue;
        blobs.push_back({id, object.size_bytes, object.modified});
      }
      token = std::move(page.next_token);
    } while (!token.empty());
    std::ranges::sort(blobs, {}, &BlobInfo::id);
    return absl::OkStatus();
  }

  // Error of a list that S3 would never return, and that could be endless.
  absl::Status BadList(const std::string& prefix, const char* why) const {
    return absl::UnavailableError(absl::StrCat("list of ", shared_->s3->NameOf(prefix), ": ", why,
                                               "; the store is at fault"));
  }

  // Deletes the cached copy of a deleted object, but not that of an upload, which may be a copy of
  // other blobs, too.
  absl::Status Forget(const BlobId& id) {
    return IsUploadId(id) ? absl::OkStatus() : shared_->cache->Delete(id);
  }

  // Whether the cache may answer for this id. A client may have made a file that collides with
  // another blob under XXH3, so such an upload never gets that name in the cache.
  static bool IsCachedByName(const BlobId& id) {
    return !IsUploadId(id) || HashKindOf(id) == HashKind::kSha256;
  }

  absl::Status DamageOf(const std::string& key, int64_t size, const BlobId& found) const {
    return absl::DataLossError(absl::StrCat("blob ", shared_->s3->NameOf(key), " is damaged: its ",
                                            size, " bytes hash to ", found));
  }

  // Fetches the object through the cache, where it stays as far as there is room.
  absl::StatusOr<std::shared_ptr<const Blob>> Fetch(const BlobId& id, int64_t size) {
    const std::string key = BlobKey(id);
    const absl::Status made = shared_->cache->MakeRoom(size);
    if (!made.ok()) base::LogWarning(absl::StrCat("cache: ", made.message()));
    LB_ASSIGN_OR_RETURN(
        const std::unique_ptr<BlobWriter> writer,
        IsCachedByName(id) ? shared_->cache->CreateAs(ContentIdOf(id)) : shared_->cache->Create());
    BlobHasher named(HashKindOf(id));
    LB_RETURN_IF_ERROR(Download(*shared_->s3, key, size, [&](auto bytes) {
      if (!IsCachedByName(id)) named.Add(bytes);
      return writer->Append(bytes);
    }));
    if (!IsCachedByName(id) && named.Id() != ContentIdOf(id)) {
      return DamageOf(key, size, named.Id());
    }
    const absl::StatusOr<BlobId> cached = writer->Commit();  // compares the hash
    if (absl::IsDataLoss(cached.status())) return DamageOf(key, size, "something else");
    LB_RETURN_IF_ERROR(cached.status());
    auto blob = shared_->cache->Find(*cached);
    LB_RETURN_IF_ERROR(shared_->cache->Trim());
    return blob;
  }

  const std::shared_ptr<const Shared> shared_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<BlobStore>> OpenS3BlobStore(const std::string& url,
                                                           const S3Options& options) {
  auto shared = std::make_shared<Shared>();
  LB_ASSIGN_OR_RETURN(shared->s3, S3Client::Make(url, options));
  LB_ASSIGN_OR_RETURN(shared->cache, BlobCache::Open(options.cache_directory, options.cache_bytes));
  // A wrong bucket fails here, not at the first blob.
  const absl::Status listed = shared->s3->List(kBlobs, "").status();
  if (IsNoSuchBucket(listed) || (!listed.ok() && !base::IsTransient(listed))) return listed;
  if (!listed.ok()) {
    base::LogWarning(absl::StrCat("opened the store although S3 fails: ", listed.ToString()));
  }
  return std::make_unique<S3BlobStore>(std::move(shared));
}

}  // namespace liquidblend::store
