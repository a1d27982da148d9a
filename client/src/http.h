// HTTP transfers to and from urls that a server has given.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace liquidblend::client {

struct HttpAnswer {
  int status = 0;
  std::string etag;
  std::string body;  // its first 64 KiB; empty where a sink took it
};

// Connections are kept. Errors of calls: kUnavailable without a whole answer; messages never hold
// the url's query, which is a credential. Threads: one.
class Http {
 public:
  // ca_file: PEM of trusted authorities for https; empty: the system's.
  explicit Http(std::string ca_file);
  ~Http();
  Http(const Http&) = delete;
  Http& operator=(const Http&) = delete;

  // `source` fills the buffer with the next `size` bytes of the body, and returns their number. 0
  // before the end aborts the request.
  using Source = std::function<size_t(char* buffer, size_t size)>;
  absl::StatusOr<HttpAnswer> Put(const std::string& url,
                                 const std::map<std::string, std::string>& headers, int64_t size,
                                 const Source& source);
  absl::StatusOr<HttpAnswer> Post(const std::string& url, const std::string& body);
  // Receives the bytes of an answer with status 200, until it returns false.
  using Sink = std::function<bool(absl::string_view bytes)>;
  absl::StatusOr<HttpAnswer> Get(const std::string& url, const Sink& sink);

 private:
  struct Exchange;
  absl::StatusOr<HttpAnswer> Run(const std::string& url, Exchange& exchange);

  const std::string ca_file_;
  void* const easy_;  // CURL
};

// OK for 2xx; else kUnavailable, kPermissionDenied (a url that has expired), kNotFound, kInternal.
absl::Status StatusOf(const HttpAnswer& answer);

}  // namespace liquidblend::client
