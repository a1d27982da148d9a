// The few calls of S3 that the blob store is made of.
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

// One bucket; S3Transport says which requests are sent again. All verbs but the creation of a
// multipart upload come to the same whether an earlier request was carried out or not, so a lost
// answer does no harm; that one leaves an upload open, which DropOldUploads() ends.
// Errors of all calls name bucket and key: kUnavailable after the last attempt, kNotFound,
// kPermissionDenied, kResourceExhausted (quota), kInternal (what S3 does not accept). No message
// has a secret. Threads: safe.
class S3Client {
 public:
  // `url` is s3://bucket/prefix; the prefix may be missing.
  // Errors: kInvalidArgument for another url, options out of range, or missing credentials;
  // kUnavailable if credentials cannot be got now.
  static absl::StatusOr<std::unique_ptr<S3Client>> Make(const std::string& url, S3Options options);

  const S3Options& options() const { return options_; }
  // "s3://bucket/prefix/key", for messages; keys are relative to the prefix.
  std::string NameOf(const std::string& key) const;

  // kNotFound only if a GET is answered with NoSuchKey: any 404 to a HEAD looks the same.
  absl::StatusOr<S3Object> Find(const std::string& key);
  // The bytes [offset, offset + size) of each; all must be there.
  struct Range {
    int64_t offset = 0;
    int64_t size = 0;
  };
  absl::StatusOr<std::vector<std::string>> Get(const std::string& key,
                                               std::span<const Range> ranges);
  // In parts if it is large; then nothing is left behind if it fails. An upload of parts that S3
  // loses begins again, up to max_attempts times.
  absl::Status Put(const std::string& key, std::span<const std::byte> bytes);
  absl::Status Delete(const std::string& key);  // OK too if it is not there
  // Looks at the object, and if it was last written by then deletes it right away: that request is
  // not repeated without another look. Returns whether the object is gone.
  absl::StatusOr<bool> DeleteIfNotNewer(const std::string& key, absl::Time time);
  absl::StatusOr<S3Page> List(const std::string& prefix, const std::string& token);
  // Aborts the uploads in parts below that prefix that were begun no later than that. Returns how
  // many.
  absl::StatusOr<int64_t> DropOldUploads(const std::string& prefix, absl::Time time);

  // Urls on client_endpoint.  Requires: there is one.
  absl::StatusOr<std::string> PresignGet(const std::string& key, absl::Duration expires);
  // For an object of that size, which is signed with the urls; its id is left empty. None of them
  // replaces an object. In parts if it is large: then S3 keeps those of an upload that is never
  // completed until DropOldUploads().
  absl::StatusOr<DirectUpload> PresignPut(const std::string& key, int64_t size_bytes,
                                          absl::Duration expires);
  int64_t NumPartUrls(int64_t size_bytes) const;  // that PresignPut() gives
  // Ends an upload of parts. Asks once, and logs an error.
  void DropUpload(const std::string& key, const std::string& upload_id);

 private:
  // An upload in parts that was begun.
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
