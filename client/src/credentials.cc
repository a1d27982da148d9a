#include "client/src/credentials.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/connection/loopback.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

// The text of a PEM file that has a `label`, such as "CERTIFICATE"; "" of "". gRPC would not tell a
// wrong file from a server that does not answer.
absl::StatusOr<std::string> ReadPem(const char* field, const char* label, const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return absl::NotFoundError(
        absl::StrCat(field, ": ", path, " cannot be read: ", std::strerror(errno)));
  }
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (absl::StrContains(text, absl::StrCat(label, "-----"))) return text;
  return absl::InvalidArgumentError(
      absl::StrCat(field, ": ", path, " has no PEM block of a ", label));
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(
    const SecurityOptions& options) {
  if (!options.uses_tls()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  LBC_ASSIGN_OR_RETURN(ssl.pem_root_certs, ReadPem("tls_ca", "CERTIFICATE", options.tls_ca));
  LBC_ASSIGN_OR_RETURN(ssl.pem_cert_chain, ReadPem("tls_cert", "CERTIFICATE", options.tls_cert));
  LBC_ASSIGN_OR_RETURN(ssl.pem_private_key, ReadPem("tls_key", "PRIVATE KEY", options.tls_key));
  return grpc::SslCredentials(ssl);
}

absl::Status CheckTokenIsSafe(const SecurityOptions& options, const std::string& target) {
  if (options.token.empty() || options.uses_tls() || IsThisMachine(target)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("token: without TLS it would go to ", target,
                                                 " for everyone on the way to read"));
}

}  // namespace liquidblend::client
