// Client for the calls of S3 that the blob store uses.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/blobs/s3_options.h"
#include "core/store/blobs/s3_transport.h"
#include "core/store/blobs/s3_xml.h"

namespace liquidblend::store {

// Client of one bucket. S3Transport decides which requests are sent again. All verbs but the
// creation of a multipart upload are idempotent, so a lost answer does no harm. A lost answer to a
// creation leaves an open upload, which DropOldUploads() aborts. Errors of all calls name bucket
// and key: kUnavailable after the last attempt, kNotFound, kPermissionDenied, kResourceExhausted
// (quota), kInternal (a request that S3 does not accept). No message has a secret. Threads: safe.
class S3Client {
 public:
  // Makes a client of `url`, s3://bucket/prefix; the prefix may be missing. Errors:
  // kInvalidArgument for another url, options out of range, or missing credentials; kUnavailable if
  // credentials cannot be got now.
  static absl::StatusOr<std::unique_ptr<S3Client>> Make(const std::string& url, S3Options options);

  const S3Options& options() const { return options_; }
  // The name of an object in messages, "s3://bucket/prefix/key"; keys are relative to the prefix.
  std::string NameOf(const std::string& key) const;

  // Finds an object without reading it. Errors: kNotFound only if a GET is answered with NoSuchKey,
  // since any 404 to a HEAD looks the same.
  absl::StatusOr<S3Object> Find(const std::string& key);
  // Range of an object's bytes: [offset, offset + size). All of them must exist.
  struct Range {
    int64_t offset = 0;
    int64_t size = 0;
  };
  // Reads ranges of an object, in their order.
  absl::StatusOr<std::vector<std::string>> Get(const std::string& key,
                                               std::span<const Range> ranges);
  // Writes an object, in parts if it is large; nothing is left behind if that fails. A multipart
  // upload that S3 loses begins again, up to max_attempts times.
  absl::Status Put(const std::string& key, std::span<const std::byte> bytes);
  absl::Status Delete(const std::string& key);  // OK too if it is not there
  // Deletes the object if it was last written at `time` or before. Each attempt checks this first.
  // Returns whether the object is gone.
  absl::StatusOr<bool> DeleteIfNotNewer(const std::string& key, absl::Time time);
  // Lists a page of the objects whose keys begin with `prefix`; `token` is empty for the first
  // page, else the next_token of the page before.
  absl::StatusOr<S3Page> List(const std::string& prefix, const std::string& token);
  // Aborts the multipart uploads below that prefix that were begun at `time` or before. Returns the
  // number of uploads.
  absl::StatusOr<int64_t> DropOldUploads(const std::string& prefix, absl::Time time);

  // Presigns a url to GET the object, on client_endpoint.  Requires: there is one.
  absl::StatusOr<std::string> PresignGet(const std::string& key, absl::Duration expires);
  // Presigns urls to PUT an object of that size, which is signed with the urls; the result's id is
  // left empty. None of them replaces an object. Large objects get a multipart upload; if it is
  // never completed, S3 keeps its parts until DropOldUploads().
  absl::StatusOr<DirectUpload> PresignPut(const std::string& key, int64_t size_bytes,
                                          absl::Duration expires);
  int64_t NumPartUrls(int64_t size_bytes) const;  // of PresignPut()
  // Aborts a multipart upload. Tries once, and logs an error.
  void DropUpload(const std::string& key, const std::string& upload_id);

 private:
  // A multipart upload that was begun.
  struct Upload {
    std::string id;
    absl::Time created = absl::InfinitePast();  // by the clock of S3, in whole seconds
  };

  S3Client(std::string bucket, std::string prefix, const S3Options& options);
  std::string PathOf(const std::string& key) const;
  int64_t PartBytes(int64_t size_bytes) const;
  int64_t SignedPartBytes(int64_t size_bytes) const;
  absl::Status PresignParts(const std::string& key, int64_t size_bytes, absl::Duration expires,
                            DirectUpload& upload);
  absl::Status ConfirmMissing(const std::string& key);
  absl::StatusOr<Upload> CreateUpload(const std::string& key);
  absl::Status PutParts(const std::string& key, std::span<const std::byte> bytes);
  absl::Status PutPartsOnce(const std::string& key, std::span<const std::byte> bytes);
  absl::StatusOr<std::vector<std::string>> UploadParts(const std::string& key,
                                                       const std::string& upload_id,
                                                       std::span<const std::byte> bytes);
  absl::Status Complete(const std::string& key, const Upload& upload,
                        const std::vector<std::string>& etags, std::span<const std::byte> bytes);
  absl::StatusOr<bool> IsThere(const std::string& key, const Upload& upload,
                               const std::vector<std::string>& etags,
                               std::span<const std::byte> bytes);
  absl::StatusOr<S3UploadPage> ListUploads(const std::string& prefix, const std::string& after_key,
                                           const std::string& after_id);
  void Abort(const std::string& key, const std::string& upload_id, bool is_repeated = true);

  const std::string bucket_;
  const std::string prefix_;  // empty, or ends with a slash
  const S3Options options_;
  S3Transport transport_;
};

}  // namespace liquidblend::store
