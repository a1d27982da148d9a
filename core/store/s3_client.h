// The few calls of S3 that the blob store is made of.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/aws_signer.h"
#include "core/store/blob_store.h"
#include "core/store/http_client.h"
#include "core/store/s3_options.h"

namespace liquidblend::store {

struct S3Object {
  std::string key;
  int64_t size_bytes = 0;
  absl::Time modified;
};

struct S3Page {
  std::vector<S3Object> objects;  // in the order of their keys
  std::string next_token;         // empty: no more
};

// One bucket. A request that meets a lost connection, an answer that is cut off, or one of the
// statuses 408, 429 and 5xx is sent again, after a pause that doubles, with jitter.
// Errors of all calls name bucket and key: kUnavailable after the last attempt, kNotFound,
// kPermissionDenied, kResourceExhausted (quota), kInternal (what S3 does not accept). No message
// has a secret. Threads: safe.
class S3Client {
 public:
  // `url` is s3://bucket/prefix; the prefix may be missing.
  // Errors: kInvalidArgument for another url, options out of range, or missing credentials.
  static absl::StatusOr<std::unique_ptr<S3Client>> Make(const std::string& url, S3Options options);

  const S3Options& options() const { return options_; }
  // "s3://bucket/prefix/key", for messages; keys are relative to the prefix.
  std::string NameOf(const std::string& key) const;

  absl::StatusOr<S3Object> Find(const std::string& key);
  // The bytes [offset, offset + size) of each; all must be there.
  struct Range {
    int64_t offset = 0;
    int64_t size = 0;
  };
  absl::StatusOr<std::vector<std::string>> Get(const std::string& key,
                                               std::span<const Range> ranges);
  // In parts if it is large; then nothing is left behind if it fails.
  absl::Status Put(const std::string& key, std::span<const std::byte> bytes);
  absl::Status Delete(const std::string& key);  // OK too if it is not there
  // Looks at the object, and if it was last written by then deletes it right away: that request is
  // not repeated. Returns whether the object is gone.
  absl::StatusOr<bool> DeleteIfNotNewer(const std::string& key, absl::Time time);
  absl::StatusOr<S3Page> List(const std::string& prefix, const std::string& token);

  // Urls on client_endpoint.  Requires: there is one.
  std::string PresignGet(const std::string& key, absl::Duration expires) const;
  // For an object of that size, which is signed with the urls; its id is left empty. None of them
  // replaces an object. In parts if it is large: then S3 keeps those of an upload that is never
  // completed until its bucket's rules drop them.
  absl::StatusOr<DirectUpload> PresignPut(const std::string& key, int64_t size_bytes,
                                          absl::Duration expires);

 private:
  struct Call {
    std::string method = "GET";
    std::string key = {};
    std::map<std::string, std::string> query = {};
    std::vector<std::pair<std::string, std::string>> headers = {};
    std::span<const std::byte> body = {};
    bool is_repeated = true;
    int64_t max_answer_bytes = int64_t{16} << 20;
  };

  S3Client(std::string bucket, std::string prefix, S3Options options);
  HttpRequest RequestOf(const Call& call) const;
  std::string Presign(const Call& call, const std::map<std::string, std::string>& headers,
                      absl::Duration expires) const;
  std::string PathOf(const Call& call) const;
  // Side by side; the answers in the order of the calls, each of a status below 300.
  absl::StatusOr<std::vector<HttpAnswer>> Run(std::span<const Call> calls);
  absl::StatusOr<HttpAnswer> RunOne(const Call& call);
  absl::Status ErrorOf(const Call& call, const absl::StatusOr<HttpAnswer>& answer) const;
  int64_t PartBytes(int64_t size_bytes) const;
  absl::Status PutParts(const std::string& key, std::span<const std::byte> bytes);
  absl::StatusOr<std::string> UploadParts(const std::string& key, const std::string& upload_id,
                                          std::span<const std::byte> bytes);

  const std::string bucket_;
  const std::string prefix_;  // empty, or ends with a slash
  const S3Options options_;
  const AwsCredentials credentials_;
  HttpClient http_;
};

}  // namespace liquidblend::store
