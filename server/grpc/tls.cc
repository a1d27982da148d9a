#include "server/grpc/tls.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <ctime>

#include "absl/strings/str_cat.h"
#include "core/base/host.h"
#include "core/base/status_macros.h"

namespace liquidblend::server {
namespace {

struct Deleter {
  void operator()(BIO* file) const { BIO_free(file); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
template <typename T>
using Owned = std::unique_ptr<T, Deleter>;

// The first thing in a PEM file that `read` understands.
template <typename T>
absl::StatusOr<Owned<T>> ReadPem(const char* flag, const std::string& path,
                                 T* (*read)(BIO*, T**, pem_password_cb*, void*)) {
  const Owned<BIO> file(BIO_new_file(path.c_str(), "r"));
  if (file == nullptr) {
    ERR_clear_error();
    return absl::NotFoundError(absl::StrCat(flag, ": '", path, "' cannot be read"));
  }
  // A password that is asked for on the terminal would stop the server's start.
  const auto no_password = [](char*, int, int, void*) { return 0; };
  Owned<T> found(read(file.get(), nullptr, no_password, nullptr));
  ERR_clear_error();
  if (found != nullptr) return found;
  return absl::InvalidArgumentError(
      absl::StrCat(flag, ": '", path, "' holds no PEM that can be used for it without a password"));
}

}  // namespace

absl::Status TlsOptions::Validate() const {
  if (certificate.empty() && key.empty() && client_ca.empty()) return absl::OkStatus();
  if (certificate.empty() || key.empty()) {
    return absl::InvalidArgumentError("--tls-cert and --tls-key belong together; one is missing");
  }
  if (reload_seconds < 1) {
    return absl::InvalidArgumentError(
        absl::StrCat("tls option reload_seconds is out of range: ", reload_seconds));
  }
  LB_ASSIGN_OR_RETURN(const Owned<X509> x509,
                      ReadPem<X509>("--tls-cert", certificate, PEM_read_bio_X509));
  LB_ASSIGN_OR_RETURN(const Owned<EVP_PKEY> pkey,
                      ReadPem<EVP_PKEY>("--tls-key", key, PEM_read_bio_PrivateKey));
  const bool is_pair = X509_check_private_key(x509.get(), pkey.get()) == 1;
  ERR_clear_error();
  if (!is_pair) {
    return absl::InvalidArgumentError(
        absl::StrCat("--tls-key: '", key, "' is not the key of '", certificate, "'"));
  }
  if (client_ca.empty()) return absl::OkStatus();
  return ReadPem<X509>("--tls-client-ca", client_ca, PEM_read_bio_X509).status();
}

absl::StatusOr<absl::Time> CertificateExpiry(const TlsOptions& options) {
  LB_ASSIGN_OR_RETURN(const Owned<X509> x509,
                      ReadPem<X509>("--tls-cert", options.certificate, PEM_read_bio_X509));
  tm end = {};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(x509.get()), &end) == 1) {
    return absl::FromTM(end, absl::UTCTimeZone());
  }
  ERR_clear_error();
  return absl::InvalidArgumentError(
      absl::StrCat("--tls-cert: '", options.certificate, "' has no valid time of expiry"));
}

std::shared_ptr<grpc::ServerCredentials> ServerCredentialsOf(const TlsOptions& options) {
  if (!options.is_on()) return grpc::InsecureServerCredentials();
  namespace tls = grpc::experimental;
  tls::TlsServerCredentialsOptions credentials(
      std::make_shared<tls::FileWatcherCertificateProvider>(
          options.key, options.certificate, options.client_ca,
          static_cast<unsigned int>(options.reload_seconds)));
  credentials.watch_identity_key_cert_pairs();
  if (!options.client_ca.empty()) {
    credentials.watch_root_certs();
    credentials.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return tls::TlsServerCredentials(credentials);
}

bool IsLoopback(absl::string_view address) {
  const auto parts = base::SplitHostPort(address);
  return parts.has_value() && base::IsLoopbackHost(parts->host);
}

}  // namespace liquidblend::server
