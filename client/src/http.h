// HTTP transfers to and from urls that a server has given. The server is not trusted with more than
// the object store: it chooses neither other requests nor services that only this machine reaches.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace liquidblend::client {

struct HttpAnswer {
  int status = 0;
  std::string etag;
  std::string body;  // its first 64 KiB; empty where a sink took it
};

// Which hosts the urls may name.
enum class HttpHosts {
  kElsewhere,  // none on this machine, nor one of a link-local address
  kAny,
};

// Connections are kept. Errors of calls: kUnavailable without a whole answer, or if the host may
// not be named; kDataLoss if a header is none. Messages never hold the url's query, which is a
// credential. A proxy of the environment (https_proxy) decides itself which addresses it reaches.
// Less than 1 KiB/s of a file, or nothing at all, for 30 s ends a transfer. Threads: one.
class Http {
 public:
  // ca_file         PEM of trusted authorities for https; empty: the system's
  // answer_timeout  from the last byte of a request's body to the end of the answer
  Http(std::string ca_file, HttpHosts hosts, absl::Duration answer_timeout = absl::Minutes(10));
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
  void Prepare(const std::string& url, Exchange& exchange);
  absl::StatusOr<HttpAnswer> Run(const std::string& url, Exchange& exchange);

  const std::string ca_file_;
  const HttpHosts hosts_;
  const absl::Duration answer_timeout_;
  void* const easy_;  // CURL
};

// OK for 2xx; else kUnavailable, kPermissionDenied (a url that has expired), kNotFound, kInternal.
absl::Status StatusOf(const HttpAnswer& answer);

}  // namespace liquidblend::client
