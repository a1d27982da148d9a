// Certificates of the server, and of its clients.
#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace liquidblend::server {

// PEM files; all empty: no TLS. They are read again while the server runs; new ones are used for
// new connections, once key and certificate match.
struct TlsOptions {
  std::string certificate;  // chain, the server's own first
  std::string key;
  std::string client_ca;   // if given, clients must show a certificate that one of these has signed
  int reload_seconds = 5;  // >= 1
  bool is_on() const { return !certificate.empty(); }
  // Errors: kInvalidArgument (one file without the other, no certificate in it, a key that is not
  // the certificate's), kNotFound; messages name the file.
  absl::Status Validate() const;
};

// The end of the server's certificate, the first one in the file, as it is now.
// Errors: those of Validate().
absl::StatusOr<absl::Time> CertificateExpiry(const TlsOptions& options);

std::shared_ptr<grpc::ServerCredentials> ServerCredentialsOf(const TlsOptions& options);

// Whether only programs of this machine can reach HOST:PORT (base::IsLoopbackHost).
bool IsLoopback(absl::string_view address);

}  // namespace liquidblend::server
