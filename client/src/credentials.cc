#include "client/src/credentials.h"

#include <fstream>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "client/src/loopback.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

// "" of "".
absl::StatusOr<std::string> ReadPem(const char* field, const std::string& path) {
  if (path.empty()) return std::string();
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.is_open() && !file.bad() && !text.empty()) return text;
  return absl::NotFoundError(absl::StrCat(field, ": ", path, " cannot be read, or is empty"));
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> CredentialsOf(
    const SecurityOptions& options) {
  if (!options.uses_tls()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  LBC_ASSIGN_OR_RETURN(ssl.pem_root_certs, ReadPem("tls_ca", options.tls_ca));
  LBC_ASSIGN_OR_RETURN(ssl.pem_cert_chain, ReadPem("tls_cert", options.tls_cert));
  LBC_ASSIGN_OR_RETURN(ssl.pem_private_key, ReadPem("tls_key", options.tls_key));
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
