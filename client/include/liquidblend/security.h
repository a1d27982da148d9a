// Security of the connection to a server: TLS and credentials.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace liquidblend {

// Files are PEM.
struct SecurityOptions {
  bool tls = false;      // also true as soon as one of the next three is given
  std::string tls_ca;    // file of authorities trusted for the server; "": the system's
  std::string tls_cert;  // file of a certificate to show (mutual TLS), with its key; "": none
  std::string tls_key;
  std::string tls_server_name;  // that the server's certificate is for; "": the target's host
  std::string storage_ca;       // file of authorities trusted for the object store
  std::string token;            // bearer token; "": none. Only sent with TLS, or on this machine
  bool uses_tls() const { return tls || !tls_ca.empty() || !tls_cert.empty(); }
  // Names the field at fault; the message never has the token.
  absl::Status Validate() const;
};

}  // namespace liquidblend
