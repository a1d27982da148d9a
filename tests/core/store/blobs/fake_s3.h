// A small S3 server that can be told to misbehave.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "tests/core/store/blobs/http_fake.h"

namespace liquidblend::store {

// One bucket, "bucket", in memory, on any free port of 127.0.0.1. Signatures are not checked, but
// their dates are. Each connection has a thread of its own and carries one request.
// Threads: safe.
class FakeS3 {
 public:
  enum class Fault {
    kNone,
    kStatus500,
    kStatus503,       // SlowDown
    kStatus403,       // AccessDenied
    kExpiredToken,    // 403
    kReset,           // the connection, after the request came
    kAnswerLost,      // the request is carried out, then the connection is reset
    kTruncate,        // the connection is closed in the middle of the body
    kErrorInBody,     // half of the body, then an error document, as if that were all
    kFlip,            // a bit of the body
    kHang,            // no answer until StopHanging()
    kUploadVanished,  // the multipart upload is forgotten before the request is carried out
    kNoSuchBucket,    // 404
    kPlain404,        // as of a proxy, without a document of S3
    kRedirect,        // 301, to another region
    kWrongRegion,     // 400 AuthorizationHeaderMalformed
    kDrip,            // one byte of the body after another, until StopHanging()
    kSpaces,          // spaces, one after another for four seconds, before the body
    kLongBody,        // 17 MiB of spaces behind the body
    kManyHeaders,     // 1 MiB of them
  };

  FakeS3();
  ~FakeS3();
  FakeS3(const FakeS3&) = delete;
  FakeS3& operator=(const FakeS3&) = delete;

  std::string endpoint() const { return http_->url(); }

  // The faults of the next requests of that kind, one after the other. A kind is a method, or one
  // of "list", "list uploads", "create upload", "upload part", "complete upload", "abort upload";
  // of a request that belongs to both, a fault of its method counts before one of the other.
  void Plan(const std::string& kind, std::vector<Fault> faults);
  // The fault of all requests from now on that no plan has a fault for; kNone ends it.
  void SetFault(Fault fault);
  // Ends kHang as a fault of all requests, and resets the connections that hang.
  void StopHanging();
  // Moves the server's clock ahead of the system's. Signed requests whose date is more than 15
  // minutes away from it get 403 RequestTimeTooSkewed; all answers carry its date.
  void SetClockAhead(absl::Duration ahead);
  // Only requests signed with this key id are served, the others get 403 InvalidAccessKeyId; empty:
  // any.
  void SetKeyId(const std::string& key_id);
  // Requests with this session token get 400 ExpiredToken, as Amazon answers them.
  void ExpireToken(const std::string& token);
  // Lists leave out objects that were written less than this long ago.
  void SetListLag(absl::Duration lag);

  // Requests of that kind so far.
  int Count(const std::string& kind);
  // Requests so far that met this fault. One without a body to damage, or without an upload to
  // forget, does not count.
  int NumMet(Fault fault);
  // Connections that hang now.
  int NumHanging();
  // By keys without the bucket.
  std::map<std::string, std::string> Objects();
  int NumOpenUploads();

 private:
  using Request = HttpFake::Request;
  using Answer = HttpFake::Answer;
  struct Object {
    std::string content;
    std::string etag;
    absl::Time modified;
  };
  struct Upload {
    std::string key;
    absl::Time begun;
    std::map<int, std::string> parts;
  };

  void Handle(HttpFake::Connection& connection, Request request);
  void Send(HttpFake::Connection& connection, const Request& request, Fault fault, Answer answer);
  void CountMet(Fault fault) ABSL_LOCKS_EXCLUDED(mutex_);
  void Hang() ABSL_LOCKS_EXCLUDED(mutex_);
  // The first num_slow bytes of the body one after another, then the rest.
  void Drip(HttpFake::Connection& connection, const Answer& answer, size_t num_slow)
      ABSL_LOCKS_EXCLUDED(mutex_);
  static std::string KindOf(const Request& request);
  Fault NextFault(const Request& request) ABSL_LOCKS_EXCLUDED(mutex_);
  Fault TakePlanned(const std::string& kind) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Time Now() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Why the request is refused for its signature; status 200: it is not.
  Answer Refusal(const Request& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Answer Do(const Request& request) ABSL_LOCKS_EXCLUDED(mutex_);
  Answer DoObject(const Request& request, const std::string& key)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Answer DoUpload(const Request& request, const std::string& key)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Answer Complete(const Request& request, const std::string& key)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Answer List(const Request& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Answer ListUploads(const Request& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  absl::Mutex mutex_;
  std::map<std::string, Object> objects_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, Upload> uploads_ ABSL_GUARDED_BY(mutex_);  // by id
  int num_uploads_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, std::deque<Fault>> faults_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, int> counts_ ABSL_GUARDED_BY(mutex_);
  std::map<Fault, int> num_met_ ABSL_GUARDED_BY(mutex_);
  Fault fault_of_all_ ABSL_GUARDED_BY(mutex_) = Fault::kNone;
  absl::Duration clock_ahead_ ABSL_GUARDED_BY(mutex_);
  absl::Duration list_lag_ ABSL_GUARDED_BY(mutex_);
  std::string key_id_ ABSL_GUARDED_BY(mutex_);
  std::set<std::string> expired_tokens_ ABSL_GUARDED_BY(mutex_);
  int num_hanging_ ABSL_GUARDED_BY(mutex_) = 0;
  int hang_round_ ABSL_GUARDED_BY(mutex_) = 0;  // of StopHanging()
  std::unique_ptr<HttpFake> http_;
};

}  // namespace liquidblend::store
