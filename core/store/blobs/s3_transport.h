// Signed requests to S3, with retries, and with credentials and a time that S3 accepts.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/blobs/aws_credentials.h"
#include "core/store/blobs/aws_signer.h"
#include "core/store/blobs/http_client.h"
#include "core/store/blobs/s3_options.h"

namespace liquidblend::store {

// One call of S3, before it is signed.
struct S3Call {
  std::string method = "GET";
  std::string path = {};  // "/bucket/key", not encoded
  std::map<std::string, std::string> query = {};
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::span<const std::byte> body = {};
  bool is_repeated = true;
  int64_t max_answer_bytes = int64_t{16} << 20;
  // Marks of a complete answer; without them it counts as cut short, whatever its status: the size
  // of its body (-1: any), and an XML tag that ends it (empty: none).
  int64_t answer_bytes = -1;
  std::string closing_tag = {};
  absl::Duration drip_limit = absl::ZeroDuration();  // as HttpRequest's
};

// Transport of signed calls. A request that meets a lost connection, an answer that is cut short,
// or one of the statuses 408, 409, 429 and 5xx is sent again after a pause that doubles, with
// jitter. One that is refused (statuses 401 and 403, tokens that have expired) is sent again once
// with the server's time, if that differs from the local clock, and once with new credentials, if
// there are any. The same holds for a request to a bucket that does not exist or to another region.
// A redirect, and a 404 without the error document of S3, may come from a proxy in between: they
// are sent again as well.
// Errors of all calls name bucket and key, and have no secret: kUnavailable after the last attempt;
// kPermissionDenied; kNotFound if S3 says NoSuchKey, and for any 404 to a HEAD, whose answer has no
// body; kAborted for a multipart upload that does not exist; kAlreadyExists for a precondition that
// does not hold; kResourceExhausted (quota); kInternal (a request that S3 does not accept).
// Threads: safe.
class S3Transport {
 public:
  // Requires: options are valid and filled.
  explicit S3Transport(const S3Options& options);

  // Finds credentials.  Errors: those of AwsCredentialsProvider.
  absl::Status Prepare() { return credentials_.Get().status(); }

  // Runs calls side by side. Returns the answers in the order of the calls, each of a status below
  // 300.
  absl::StatusOr<std::vector<HttpAnswer>> Run(std::span<const S3Call> calls);
  // Runs one call.
  absl::StatusOr<HttpAnswer> RunOne(const S3Call& call);

  // Presigns a url on client_endpoint; `headers` as PresignQuery() has them.  Requires: there is
  // one.
  absl::StatusOr<std::string> Presign(const S3Call& call,
                                      const std::map<std::string, std::string>& headers,
                                      absl::Duration expires);

  // Sleeps for the pause after so many failed attempts.
  void PauseAfter(int num_failures) const;

 private:
  struct Signer {
    AwsCredentials credentials;
    absl::Time now;  // by the server's clock
  };
  struct Round;
  struct Remedies;

  absl::Time Now() const;
  HttpRequest RequestOf(const S3Call& call, const Signer& signer) const;
  absl::StatusOr<Round> RunOpen(std::span<const S3Call> calls, const std::vector<size_t>& open,
                                std::vector<HttpAnswer>& answers);
  bool Remedy(const Round& round, Remedies& tried);

  const S3Options options_;
  AwsCredentialsProvider credentials_;
  std::atomic<int64_t> clock_ahead_us_ = 0;  // the server's clock before the local one
  HttpClient http_;
};

// Outcome of an attempt at a call: done, to be sent again, refused (perhaps because of the
// credentials or the clock), or failed for good.
enum class S3Verdict { kDone, kTransient, kRefused, kFailed };
// Judges one attempt at a call by its answer.
S3Verdict JudgeS3Answer(const S3Call& call, const absl::StatusOr<HttpAnswer>& answer);
// The error of a call with that verdict, as S3Transport gives it.  Requires: it is not kDone.
absl::Status S3ErrorOf(const S3Call& call, const absl::StatusOr<HttpAnswer>& answer,
                       S3Verdict verdict);

// Whether the error of a call says that the bucket does not exist.
bool IsNoSuchBucket(const absl::Status& error);

}  // namespace liquidblend::store
