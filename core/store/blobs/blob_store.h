// Immutable byte strings, named by their content.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// "sha256-" and the 64 hexadecimal digits of the content's SHA-256. Blobs of older stores are
// called "xxh3-" and the 32 digits of their XXH3-128: they stay readable, but no content gets such
// a name any more unless it is copied from such a store (CreateAs), since anyone can make two
// contents of one XXH3.
using BlobId = std::string;

// The bytes of one blob; memory-mapped where the backend can.  Threads: safe, immutable.
class Blob {
 public:
  virtual ~Blob() = default;
  virtual std::span<const std::byte> bytes() const = 0;
  // kDataLoss once a part of the bytes could not be read and read as zeros (mapped_file.h). Whoever
  // uses the bytes of a blob for long looks here before it hands out what it made of them.
  virtual absl::Status Check() const { return absl::OkStatus(); }
};

// Receives one blob's bytes in order. Dropped without Commit(), it leaves nothing behind that a
// reader could see. Threads: one at a time.
class BlobWriter {
 public:
  virtual ~BlobWriter() = default;
  // Errors: kResourceExhausted (disk full), kPermissionDenied, kDataLoss (the disk fails),
  // kUnavailable; the message names the path. After an error the writer can only be dropped.
  virtual absl::Status Append(std::span<const std::byte> bytes) = 0;
  // Makes the blob durable and visible, and returns its id. At most once, nothing after it. If the
  // store has this content already it stays, and BlobInfo::modified becomes now. A damaged blob of
  // that id is moved to quarantine first.
  // Errors, also: kAlreadyExists if another content that matches the id is there (only ids of XXH3
  // have such collisions): what is there stays.
  virtual absl::StatusOr<BlobId> Commit() = 0;
};

struct BlobInfo {
  BlobId id;
  int64_t size_bytes = 0;
  absl::Time modified;
};

// How someone without credentials sends a blob to where it is kept: each url takes its bytes by
// PUT, with these headers. Of more than one part, the answers' ETags go to complete_url by POST, as
// <CompleteMultipartUpload><Part><PartNumber>1</PartNumber><ETag>..</ETag></Part>...
struct DirectUpload {
  BlobId id;  // what it can be opened by, once it is there
  int64_t part_bytes = 0;
  std::vector<std::string> part_urls;  // of part_bytes each, the last one of the rest
  std::map<std::string, std::string> headers;
  std::string complete_url;  // empty: of one part
  std::string multipart_id;  // of the store, not for clients; empty: of one part
};

// Threads: safe; processes: safe. Errors as BlobWriter's, and those given.
class BlobStore {
 public:
  virtual ~BlobStore() = default;
  // A new blob, named by its content.
  virtual absl::StatusOr<std::unique_ptr<BlobWriter>> Create() = 0;
  // A blob whose id is known, as when it is copied from another store. Commit() fails with
  // kDataLoss and changes nothing unless the bytes match the id.  Errors: kInvalidArgument if it is
  // none.
  virtual absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) = 0;
  // A file that a client sends through the server. It gets an id of its own (IsUploadId), even if
  // the same content is there, so whoever breaks off an upload can delete it: nobody else needs it.
  virtual absl::StatusOr<std::unique_ptr<BlobWriter>> CreateUpload() = 0;
  // Verifies the whole content against its name on open. A blob that is deleted while it is open
  // stays readable.
  // Errors: kNotFound; kDataLoss if the content does not match or cannot be read;
  // kPermissionDenied; messages name the path. kInvalidArgument if `id` is no blob id.
  virtual absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) = 0;
  // Reads what is kept, past any cache, and compares it with its name. Errors: as Open().
  virtual absl::Status Verify(const BlobId& id) = 0;
  // OK too if there is no such blob.
  virtual absl::Status Delete(const BlobId& id) = 0;
  // Deletes the blob unless it was committed after that time, also if that happens meanwhile: then
  // it is there when both calls have returned. Returns whether it is gone.
  virtual absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) = 0;
  // Moves a damaged blob to where no other call finds it. Returns where that is.
  // Errors: kNotFound; kFailedPrecondition if it is whole, and stays.
  virtual absl::StatusOr<std::string> Quarantine(const BlobId& id) = 0;
  // In the order of their ids, files of uploads last.
  virtual absl::StatusOr<std::vector<BlobInfo>> List() = 0;

  // Lets go of copies of blobs that can be got again, those not used for the longest time first,
  // until so much is free on the disk that they are on; of none if that would not do.
  virtual absl::Status MakeRoom(int64_t /*free_bytes*/) { return absl::OkStatus(); }

  // Urls for a blob of this content (as its sender says) and size, that are good until `expires`
  // later. It gets an id of its own (IsUploadId), and is compared with what the sender said when it
  // is opened; once there, it cannot be replaced by way of the urls.
  // Errors: kUnimplemented if the store offers none.
  virtual absl::StatusOr<DirectUpload> PresignUpload(const BlobId& content, int64_t size_bytes,
                                                     absl::Duration expires);
  // How many part_urls PresignUpload() gives for a blob of this size; 1 if it gives none at all.
  virtual int64_t NumPartUrls(int64_t /*size_bytes*/) const { return 1; }
  // Ends an upload whose urls nobody has got, so that the store keeps nothing of it. Asks the store
  // once; what it does not do then is logged.
  virtual void DropUpload(const DirectUpload& /*upload*/) {}
  // Ends uploads in parts that were begun no later than that and are neither complete nor given up:
  // whoever sends parts to one begins again. Returns how many.
  virtual absl::StatusOr<int64_t> DropOldUploads(absl::Time /*time*/) { return 0; }
  // A url to GET the blob from, good until `expires` later.
  // Errors: kUnimplemented as above; kNotFound.
  virtual absl::StatusOr<std::string> PresignDownload(const BlobId& id, absl::Duration expires);
  // Of one that was sent directly, without reading it.  Errors: kUnimplemented as above; kNotFound.
  virtual absl::StatusOr<int64_t> SizeOfUpload(const BlobId& id);
};

// Whether `id` is written like a blob id.
bool IsBlobId(absl::string_view id);

// Files of uploads have ids of their own: that of their content (where it was sent directly, of the
// content that the client promised), "-", and 32 random hexadecimal digits.
bool IsUploadId(absl::string_view id);

// The part of either kind of id that says what the content is.  Requires: it is such an id.
BlobId ContentIdOf(absl::string_view id);

// Where a blob lies below its store's directory or prefix: "blobs/<2 digits>/<id>", of uploads
// "uploads/<2 digits>/<id>".  Requires: IsBlobId(id) or IsUploadId(id).
std::string BlobKey(const BlobId& id);

// kInvalidArgument unless `id` is of a blob or an upload.
absl::Status CheckBlobId(absl::string_view id);

// Blobs as files under `directory`, which is created if missing: BlobKey(id), written as
// tmp/<pid>-<unique>, flushed, then renamed; the directories are flushed too. A writer holds a lock
// (flock) on its temporary file; those that nobody holds are left over and removed on opening.
// Quarantined ones lie in quarantine/.
enum class Durability { kDurable, kCache };  // a cache flushes nothing
absl::StatusOr<std::unique_ptr<BlobStore>> OpenLocalBlobStore(
    const std::string& directory, Durability durability = Durability::kDurable);

// The file of a blob there.
std::string LocalBlobPath(const std::string& directory, const BlobId& id);

// One blob from bytes in memory; as CreateAs() with an id.
absl::StatusOr<BlobId> PutBlob(BlobStore& blobs, std::span<const std::byte> bytes);
absl::Status PutBlobAs(BlobStore& blobs, const BlobId& id, std::span<const std::byte> bytes);

}  // namespace liquidblend::store
