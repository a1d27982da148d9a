#include "server/grpc/check_serving.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include <chrono>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::server {
namespace {

constexpr char kServing[] = {0x08, 0x01};  // HealthCheckResponse{status: SERVING}

absl::StatusOr<std::string> AddressToAsk(const std::string& listen) {
  const size_t colon = listen.rfind(':');
  const std::string port = colon == std::string::npos ? "" : listen.substr(colon + 1);
  if (port.empty() || port == "0") {
    return absl::InvalidArgumentError(
        absl::StrCat("--check needs the port in --listen, got '", listen, "'"));
  }
  const std::string host = listen.substr(0, colon);
  if (host == "0.0.0.0") return absl::StrCat("127.0.0.1:", port);
  if (host == "[::]") return absl::StrCat("[::1]:", port);
  return listen;
}

// Credentials of the probe. The server's certificate is not verified: the probe sends no secret,
// and the answer is a status only.
std::shared_ptr<grpc::ChannelCredentials> CredentialsFor(const TlsOptions& tls) {
  if (!tls.is_on()) return grpc::InsecureChannelCredentials();
  namespace experimental = grpc::experimental;
  experimental::TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_check_call_host(false);
  options.set_certificate_verifier(std::make_shared<experimental::NoOpCertificateVerifier>());
  if (!tls.client_ca.empty()) {
    options.set_certificate_provider(std::make_shared<experimental::FileWatcherCertificateProvider>(
        tls.key, tls.certificate, static_cast<unsigned int>(tls.reload_seconds)));
    options.watch_identity_key_cert_pairs();
  }
  return experimental::TlsCredentials(options);
}

// The answer's bytes; its proto is no part of the build.
absl::StatusOr<std::string> Ask(const std::shared_ptr<grpc::Channel>& channel,
                                absl::Duration timeout) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + absl::ToChronoMicroseconds(timeout));
  grpc::CompletionQueue queue;
  const grpc::Slice nothing;
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check",
                                          grpc::ByteBuffer(&nothing, 1), &queue);
  call->StartCall();
  grpc::ByteBuffer answer;
  grpc::Status status;
  call->Finish(&answer, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  if (!status.ok()) return absl::UnavailableError(status.error_message());
  grpc::Slice bytes;
  if (!answer.DumpToSingleSlice(&bytes).ok()) return absl::InternalError("an answer in no memory");
  return std::string(reinterpret_cast<const char*>(bytes.begin()), bytes.size());
}

}  // namespace

absl::Status CheckServing(const std::string& listen, const TlsOptions& tls,
                          absl::Duration timeout) {
  LB_RETURN_IF_ERROR(tls.Validate());
  LB_ASSIGN_OR_RETURN(const std::string address, AddressToAsk(listen));
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // the server is on this machine
  const absl::StatusOr<std::string> answer =
      Ask(grpc::CreateCustomChannel(address, CredentialsFor(tls), arguments), timeout);
  if (!answer.ok()) {
    return absl::UnavailableError(absl::StrCat(address, ": ", answer.status().message()));
  }
  if (*answer == std::string(kServing, sizeof(kServing))) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(address, " is not serving"));
}

}  // namespace liquidblend::server
