// Authentication of callers by bearer token or client certificate, for gRPC and HTTP alike.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "server/access/principal.h"
#include "server/access/token_file.h"

namespace liquidblend::server {

// Threads: safe.
class Authorizer {
 public:
  // Without a file: everyone may do everything, under the name of the certificate or kAnonymous.
  Authorizer() = default;
  // Errors: ReadTokenFile()'s.
  static absl::StatusOr<std::unique_ptr<Authorizer>> Open(const std::string& path);

  // bearer: the token of "authorization: Bearer TOKEN", or empty. certificate_subject: of a client
  // certificate that the connection has verified, in the form of TLS libraries, or empty. peer: the
  // address of the connection, HOST:PORT. A token counts before a certificate.
  // Errors: kUnauthenticated (google.rpc.ErrorInfo: TOKEN_MISSING, TOKEN_UNKNOWN,
  // CERTIFICATE_UNKNOWN). No message or log line has the token.
  absl::StatusOr<Principal> Check(absl::string_view bearer, absl::string_view certificate_subject,
                                  absl::string_view peer) const;

  // The principals of the file, kAnonymous included if it has it; none without a file.
  std::vector<Principal> Principals() const;

  // Reads the file again if it has changed since it was read; to be called about once a second. A
  // file that could not be read is tried again by each call, as a token may have been revoked in
  // it. Errors: ReadTokenFile()'s; the previous token file is kept. Each error is returned once,
  // until the file changes or something else is wrong with it.
  absl::Status ReloadIfChanged();

 private:
  explicit Authorizer(std::string path) : path_(std::move(path)) {}
  std::shared_ptr<const TokenFile> File() const;

  const std::string path_;    // empty: no file
  absl::Mutex reload_mutex_;  // taken before mutex_, and held while the file is read
  std::string stamp_ ABSL_GUARDED_BY(reload_mutex_);  // of the file whose content is known
  std::string told_ ABSL_GUARDED_BY(reload_mutex_);   // a failed read that was returned
  mutable absl::Mutex mutex_;
  std::shared_ptr<const TokenFile> file_ ABSL_GUARDED_BY(mutex_);
};

// The token in the value of an "authorization" header; empty if there is none.
absl::string_view BearerToken(absl::string_view authorization);

// The host of a connection's address, by which anonymous callers are told apart: of HOST:PORT,
// "[HOST]:PORT", or these after "ipv4:" or "ipv6:". Of IPv6 it is the /64, as one host may have all
// addresses of that: "2001:db8:0:1::/64". An IPv4 address that is mapped to IPv6 is the IPv4 one.
std::string HostOfPeer(absl::string_view peer);

}  // namespace liquidblend::server
