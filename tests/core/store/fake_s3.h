// A tiny S3 server that can be told to misbehave.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace liquidblend::store {

// One bucket, "bucket", in memory, on any free port of 127.0.0.1. Signatures are not checked.
// Threads: safe.
class FakeS3 {
 public:
  enum class Fault {
    kNone,
    kStatus500,
    kStatus503,
    kStatus403,
    kReset,     // the connection, after the request came
    kTruncate,  // the connection is closed in the middle of the body
    kFlip,      // a bit of the body
  };

  FakeS3();
  ~FakeS3();
  FakeS3(const FakeS3&) = delete;
  FakeS3& operator=(const FakeS3&) = delete;

  std::string endpoint() const;
  // What the next requests of that method meet, one after the other.
  void Plan(const std::string& method, std::vector<Fault> faults);
  // Requests of that method so far.
  int Count(const std::string& method);
  // By keys without the bucket.
  std::map<std::string, std::string> Objects();
  int NumOpenUploads();

 private:
  struct Request {
    std::string method;
    std::string path;
    std::map<std::string, std::string> query;
    std::map<std::string, std::string> headers;
    std::string body;
  };
  struct Answer {
    int status = 200;
    std::string headers;
    std::string body;
  };

  void Serve();
  void Handle(int connection);
  static bool Read(int connection, Request& request);
  Fault NextFault(const std::string& method) ABSL_LOCKS_EXCLUDED(mutex_);
  Answer Do(const Request& request) ABSL_LOCKS_EXCLUDED(mutex_);
  Answer DoUpload(const Request& request, const std::string& key)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Answer List(const Request& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  int listener_ = -1;
  int port_ = 0;
  absl::Mutex mutex_;
  std::map<std::string, std::string> objects_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::map<int, std::string>> uploads_ ABSL_GUARDED_BY(mutex_);
  int num_uploads_ ABSL_GUARDED_BY(mutex_) = 0;
  std::map<std::string, std::deque<Fault>> faults_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, int> counts_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace liquidblend::store
