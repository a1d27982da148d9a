// HTTP client: requests that run side by side on the calling thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace liquidblend::store {

// One HTTP request.
struct HttpRequest {
  std::string method = "GET";
  std::string url;
  std::vector<std::pair<std::string, std::string>> headers;
  std::span<const std::byte> body;  // must stay until the request is done
  int64_t max_answer_bytes = int64_t{16} << 20;
  // Time limit within which any byte counts as progress, if it is longer than three stall timeouts.
  absl::Duration drip_limit = absl::ZeroDuration();
  // Ends the request with kUnavailable within a second once it is true; null: nothing does.
  const std::atomic<bool>* stop = nullptr;
};

// Answer to a request: its status, headers and body.
struct HttpAnswer {
  int status = 0;
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;
};

// Options of a client: authorities, time limits, proxies.
struct HttpOptions {
  std::string ca_file = {};  // trusted authorities for https; empty: the system's
  absl::Duration connect_timeout = absl::Seconds(5);
  // Time limit of an exchange without progress; not shorter than connect_timeout. One that takes
  // more than three times as long (or the request's drip_limit) must also have moved 16 KiB for
  // each further second.
  absl::Duration stall_timeout = absl::Seconds(20);
  bool is_proxied = true;  // by the proxies that the environment names (http_proxy, ...)
};

// HTTP client. Connections are kept for later requests. Redirects are not followed. Threads: safe.
class HttpClient {
 public:
  explicit HttpClient(HttpOptions options);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  // Runs the requests side by side. Returns the answers in the order of the requests, whatever
  // their status. Errors: kUnavailable if there is no whole answer (no connection, reset, cut off,
  // too slow), kResourceExhausted if its body is longer than max_answer_bytes, or its headers than
  // 256 KiB; kInvalidArgument for an invalid url.
  std::vector<absl::StatusOr<HttpAnswer>> Run(std::span<const HttpRequest> requests)
      ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  class Connections;

  const HttpOptions options_;
  absl::Mutex mutex_;
  std::vector<std::unique_ptr<Connections>> idle_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::store
