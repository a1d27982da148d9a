#include "server/grpc/tls.h"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "tests/server/certificates.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using store::Fails;

class TlsTest : public ServerTest {
 protected:
  void SetUp() override { Install(server_authority_.Sign("the server")); }

  void Install(const PemPair& pair) const {
    ReplaceFile(path("server.key"), pair.key);
    ReplaceFile(path("server.crt"), pair.certificate);
    ReplaceFile(path("clients.crt"), client_authority_.certificate());
  }

  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }

  TlsOptions Files(bool mutual) const {
    TlsOptions options;
    options.certificate = path("server.crt");
    options.key = path("server.key");
    if (mutual) options.client_ca = path("clients.crt");
    options.reload_seconds = 1;
    return options;
  }

  void StartTls(bool mutual, std::shared_ptr<Authorizer> authorizer = nullptr) {
    ServerOptions options;
    options.tls = Files(mutual);
    options.authorizer = std::move(authorizer);
    Start(options);
  }

  // Over a connection of its own.
  grpc::Status List(const grpc::SslCredentialsOptions& ssl) const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    const auto channel =
        grpc::CreateCustomChannel(server_->address(), grpc::SslCredentials(ssl), arguments);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    v1::ListFamiliesResponse response;
    return v1::LiquidBlend::NewStub(channel)->ListFamilies(&context, {}, &response);
  }

  grpc::SslCredentialsOptions Believing(const TestAuthority& authority) const {
    grpc::SslCredentialsOptions ssl;
    ssl.pem_root_certs = authority.certificate();
    return ssl;
  }

  grpc::SslCredentialsOptions Showing(const PemPair& pair) const {
    grpc::SslCredentialsOptions ssl = Believing(server_authority_);
    ssl.pem_cert_chain = pair.certificate;
    ssl.pem_private_key = pair.key;
    return ssl;
  }

  TestAuthority server_authority_{"an authority for servers"};
  TestAuthority client_authority_{"an authority for clients"};
};

TEST_F(TlsTest, OnlyThoseWhoSpeakTlsAndBelieveTheServerGetThrough) {
  StartTls(false);
  EXPECT_THAT(List(Believing(server_authority_)), IsOk());
  EXPECT_EQ(List(Believing(client_authority_)).error_code(), grpc::StatusCode::UNAVAILABLE);
  grpc::ClientContext context;
  v1::ListFamiliesResponse response;
  EXPECT_EQ(stub_->ListFamilies(&context, {}, &response).error_code(),
            grpc::StatusCode::UNAVAILABLE);
}

TEST_F(TlsTest, MutualTlsAsksForACertificateOfTheRightAuthority) {
  StartTls(true);
  EXPECT_THAT(List(Showing(client_authority_.Sign("render-1"))), IsOk());
  EXPECT_EQ(List(Believing(server_authority_)).error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(List(Showing(server_authority_.Sign("render-1"))).error_code(),
            grpc::StatusCode::UNAVAILABLE);
}

TEST_F(TlsTest, ACertificatesSubjectIsThePrincipal) {
  ReplaceFile(path("tokens.json"), R"({"principals": [{"name": "farm", "scopes": ["frames"],
                                       "certificate_subject": "CN=render-1"}]})");
  StartTls(true, *Authorizer::Open(path("tokens.json")));
  EXPECT_THAT(List(Showing(client_authority_.Sign("render-1"))), IsOk());
  const grpc::Status status = List(Showing(client_authority_.Sign("render-2")));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  const auto info = DetailOf<google::rpc::ErrorInfo>(status);
  EXPECT_EQ(info.reason(), "CERTIFICATE_UNKNOWN");
  EXPECT_EQ(info.metadata().at("subject"), "CN=render-2");
}

TEST_F(TlsTest, NewCertificatesCountWithoutARestart) {
  StartTls(false);
  TestAuthority next("the next authority");
  EXPECT_FALSE(List(Believing(next)).ok());
  Install(next.Sign("the server"));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!List(Believing(next)).ok()) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline);
    std::this_thread::yield();
  }
}

TEST_F(TlsTest, TheExpiryOfTheCertificateIsAMetric) {
  const absl::StatusOr<absl::Time> expiry = CertificateExpiry(Files(false));
  ASSERT_TRUE(expiry.ok()) << expiry.status();
  EXPECT_GT(*expiry, absl::Now() + absl::Hours(23));
  EXPECT_LT(*expiry, absl::Now() + absl::Hours(25));
  StartTls(false);
  absl::Notification is_done;
  absl::StatusOr<std::string> text;
  server_->api().GetMetricsText([&](absl::StatusOr<std::string> answer) {
    text = std::move(answer);
    is_done.Notify();
  });
  is_done.WaitForNotification();
  ASSERT_TRUE(text.ok()) << text.status();
  EXPECT_THAT(*text, testing::HasSubstr(absl::StrCat("expiry_timestamp_seconds ",
                                                     absl::ToUnixSeconds(*expiry), "\n")));
}

TEST_F(TlsTest, AFileWithoutACertificateHasNoExpiry) {
  TlsOptions options = Files(false);
  options.certificate = path("none");
  EXPECT_THAT(CertificateExpiry(options), Fails(absl::StatusCode::kNotFound, "none"));
  options.certificate = options.key;
  EXPECT_THAT(CertificateExpiry(options), Fails(absl::StatusCode::kInvalidArgument, "no PEM"));
}

TEST_F(TlsTest, WrongFilesAreNamedAtTheStart) {
  TlsOptions options = Files(true);
  EXPECT_TRUE(options.Validate().ok()) << options.Validate();
  options.key = "";
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kInvalidArgument, "--tls-key"));
  options.key = path("none");
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kNotFound, "none"));
  options.key = options.certificate;
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kInvalidArgument, "holds no PEM"));
  ReplaceFile(path("other.key"), server_authority_.Sign("another").key);
  options.key = path("other.key");
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kInvalidArgument, "is not the key of"));
  options = Files(true);
  options.client_ca = options.key;
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kInvalidArgument, "--tls-client-ca"));
  options.client_ca.clear();
  options.reload_seconds = 0;
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kInvalidArgument, "reload_seconds"));
}

TEST_F(TlsTest, WithoutItOnlyTheLoopbackIsListenedOnUnlessAskedFor) {
  ServerOptions options;
  options.listen = "0.0.0.0:0";
  EXPECT_THAT(options.Validate(), Fails(absl::StatusCode::kInvalidArgument, "--insecure"));
  options.allow_insecure = true;
  EXPECT_TRUE(options.Validate().ok());
  options.allow_insecure = false;
  options.tls = Files(false);
  EXPECT_TRUE(options.Validate().ok());
}

TEST(IsLoopback, IsWhatOnlyThisMachineReaches) {
  for (const char* local : {"127.0.0.1:50051", "127.1.2.3:1", "localhost:0", "[::1]:50051"}) {
    EXPECT_TRUE(IsLoopback(local)) << local;
  }
  for (const char* open :
       {"0.0.0.0:50051", "[::]:1", "10.0.0.1:1", "127.evil.example:1", "localhost.example:1",
        ":50051", "127.0.0.1.5:1", "127.:1", "::1:50051"}) {
    EXPECT_FALSE(IsLoopback(open)) << open;
  }
}

}  // namespace
}  // namespace liquidblend::server
