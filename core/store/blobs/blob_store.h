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

// Name of a blob: "sha256-" and the 64 hexadecimal digits of the content's SHA-256. Blobs of older
// stores are called "xxh3-" and the 32 digits of their XXH3-128. They stay readable, but new
// content gets no such name, since anyone can make two contents of one XXH3; only copies from such
// a store do (CreateAs).
using BlobId = std::string;

// The bytes of one blob; memory-mapped where the backend can.  Threads: safe, immutable.
class Blob {
 public:
  virtual ~Blob() = default;
  virtual std::span<const std::byte> bytes() const = 0;
  // Checks that the bytes were readable so far: kDataLoss once a part of them could not be read and
  // was read as zeros (mapped_file.h). Long users of a blob's bytes call this before they publish
  // their result.
  virtual absl::Status Check() const { return absl::OkStatus(); }
};

// Writer of one blob: receives its bytes in order. If it is destroyed without Commit(), readers see
// nothing of it. Threads: one at a time.
class BlobWriter {
 public:
  virtual ~BlobWriter() = default;
  // Appends bytes. Errors: kResourceExhausted (disk full), kPermissionDenied, kDataLoss (the disk
  // fails), kUnavailable; the message names the path. After an error the writer can only be
  // dropped.
  virtual absl::Status Append(std::span<const std::byte> bytes) = 0;
  // Makes the blob durable and visible, and returns its id. At most once, nothing after it. If the
  // store has this content already it stays, and BlobInfo::modified becomes now. A damaged blob of
  // that id is moved to quarantine first.
  // Errors, also: kAlreadyExists if another content that matches the id is there (only ids of XXH3
  // have such collisions); it stays.
  virtual absl::StatusOr<BlobId> Commit() = 0;
};

// Entry of a list of blobs.
struct BlobInfo {
  BlobId id;
  int64_t size_bytes = 0;
  absl::Time modified;
};

// Presigned urls by which a client without credentials sends a blob to the object store: each url
// takes its bytes by PUT, with these headers. With more than one part, the answers' ETags go to
// complete_url by POST, as
// <CompleteMultipartUpload><Part><PartNumber>1</PartNumber><ETag>..</ETag></Part>...
struct DirectUpload {
  BlobId id;  // for Open(), once it is there
  int64_t part_bytes = 0;
  std::vector<std::string> part_urls;  // of part_bytes each, the last one of the rest
  std::map<std::string, std::string> headers;
  std::string complete_url;  // empty: of one part
  std::string multipart_id;  // of the store, not for clients; empty: of one part
};

inline constexpr int64_t kMaxCatalogIdBytes = 256;

// A store of blobs. Threads: safe; processes: safe. Errors as BlobWriter's, and those given.
class BlobStore {
 public:
  virtual ~BlobStore() = default;
  // Begins a new blob, named by its content.
  virtual absl::StatusOr<std::unique_ptr<BlobWriter>> Create() = 0;
  // Begins a blob whose id is known, as when it is copied from another store. Commit() fails with
  // kDataLoss and changes nothing unless the bytes match the id.  Errors: kInvalidArgument if `id`
  // is not a blob id.
  virtual absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) = 0;
  // Begins a file that a client sends through the server. It gets an id of its own (IsUploadId),
  // even if the same content is there, so a client that breaks off an upload can delete it safely.
  virtual absl::StatusOr<std::unique_ptr<BlobWriter>> CreateUpload() = 0;
  // Opens a blob, and verifies its whole content against its name. A blob that is deleted while it
  // is open stays readable. Errors: kNotFound; kDataLoss if the content does not match or cannot be
  // read; kPermissionDenied; messages name the path. kInvalidArgument if `id` is not a blob id.
  virtual absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) = 0;
  // Reads the blob past any cache, and compares it with its name. Errors: as Open().
  virtual absl::Status Verify(const BlobId& id) = 0;
  // Deletes a blob; OK if there is none.
  virtual absl::Status Delete(const BlobId& id) = 0;
  // Deletes the blob unless it was committed after that time, also if that happens meanwhile: then
  // it is there when both calls have returned. Returns whether it is gone.
  virtual absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) = 0;
  // Moves a damaged blob to a place where no other call finds it. Returns that place.
  // Errors: kNotFound; kFailedPrecondition if it is whole, and stays.
  virtual absl::StatusOr<std::string> Quarantine(const BlobId& id) = 0;
  // Lists all blobs in the order of their ids, files of uploads last.
  virtual absl::StatusOr<std::vector<BlobInfo>> List() = 0;

  // The mark of the catalog whose blobs these are (Catalog::Id()); empty: there is none. Programs
  // of 0.2.0 leave it alone.
  virtual absl::StatusOr<std::string> ReadCatalogId() = 0;
  // Marks the store, durably, also if it has another mark.
  virtual absl::Status WriteCatalogId(const std::string& id) = 0;

  // Removes local copies of remote blobs, the least recently used ones first, until `free_bytes`
  // are free on their disk; removes none if that would not suffice.
  virtual absl::Status MakeRoom(int64_t /*free_bytes*/) { return absl::OkStatus(); }

  // Presigns urls for an upload of a blob with this content (as its sender claims) and size, valid
  // until `expires` later. It gets an id of its own (IsUploadId), and is compared with the claimed
  // content when it is opened; once there, it cannot be replaced through the urls.
  // Errors: kUnimplemented if the store offers none.
  virtual absl::StatusOr<DirectUpload> PresignUpload(const BlobId& content, int64_t size_bytes,
                                                     absl::Duration expires);
  // The number of part_urls of PresignUpload() for a blob of this size; 1 if the store signs none.
  virtual int64_t NumPartUrls(int64_t /*size_bytes*/) const { return 1; }
  // Aborts an upload whose urls were not given out, so that the store keeps nothing of it. Tries
  // once; a failure is logged.
  virtual void DropUpload(const DirectUpload& /*upload*/) {}
  // Aborts unfinished multipart uploads that were begun at `time` or before; their clients have to
  // begin again. Returns the number of uploads.
  virtual absl::StatusOr<int64_t> DropOldUploads(absl::Time /*time*/) { return 0; }
  // Presigns a url to GET the blob from, valid until `expires` later.
  // Errors: kUnimplemented as above; kNotFound.
  virtual absl::StatusOr<std::string> PresignDownload(const BlobId& id, absl::Duration expires);
  // The size of a blob that was uploaded directly, without reading it.  Errors: kUnimplemented as
  // above; kNotFound.
  virtual absl::StatusOr<int64_t> SizeOfUpload(const BlobId& id);
};

// Whether `id` is written like a blob id.
bool IsBlobId(absl::string_view id);

// Whether `id` is written like an id of an upload's file: the id of its content (where it was sent
// directly, of the content that the client promised), "-", and 32 random hexadecimal digits.
bool IsUploadId(absl::string_view id);

// The part of a blob id or upload id that names the content.  Requires: it is such an id.
BlobId ContentIdOf(absl::string_view id);

// The key of a blob below its store's directory or prefix: "blobs/<2 digits>/<id>", of uploads
// "uploads/<2 digits>/<id>".  Requires: IsBlobId(id) or IsUploadId(id).
std::string BlobKey(const BlobId& id);

// Checks that `id` is a blob id or an upload id.  Errors: kInvalidArgument.
absl::Status CheckBlobId(absl::string_view id);

// Whether a local store flushes what it writes; a cache does not.
enum class Durability { kDurable, kCache };  // a cache flushes nothing
// Opens a store of blobs as files under `directory`, which is created if missing. A file is
// BlobKey(id), written as tmp/<pid>-<unique>, flushed, then renamed; the directories are flushed
// too. A writer holds a lock (flock) on its temporary file; files without a lock are left over and
// removed on opening. Quarantined ones lie in quarantine/.
absl::StatusOr<std::unique_ptr<BlobStore>> OpenLocalBlobStore(
    const std::string& directory, Durability durability = Durability::kDurable);

// The path of a blob's file below `directory`.
std::string LocalBlobPath(const std::string& directory, const BlobId& id);

// Writes one blob from bytes in memory; with an id as CreateAs().
absl::StatusOr<BlobId> PutBlob(BlobStore& blobs, std::span<const std::byte> bytes);
absl::Status PutBlobAs(BlobStore& blobs, const BlobId& id, std::span<const std::byte> bytes);

}  // namespace liquidblend::store
