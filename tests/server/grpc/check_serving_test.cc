#include "server/grpc/check_serving.h"

#include "absl/strings/str_cat.h"
#include "tests/server/certificates.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server::check_serving_test {
namespace {

using store::Fails;
using store::Succeeds;
using Code = absl::StatusCode;

constexpr absl::Duration kPatience = absl::Seconds(30);

class CheckServingTest : public ServerTest {
 protected:
  TlsOptions Files(const PemPair& pair, const std::string& client_ca) const {
    TlsOptions tls;
    tls.certificate = folder_.path() + "/server.crt";
    tls.key = folder_.path() + "/server.key";
    ReplaceFile(tls.certificate, pair.certificate);
    ReplaceFile(tls.key, pair.key);
    if (client_ca.empty()) return tls;
    tls.client_ca = folder_.path() + "/clients.crt";
    ReplaceFile(tls.client_ca, client_ca);
    return tls;
  }

  absl::Status StartAndCheck(const TlsOptions& tls) {
    ServerOptions options;
    options.tls = tls;
    Start(options);
    return CheckServing(server_->address(), tls, kPatience);
  }

  TestAuthority authority_{"an authority"};
};

TEST_F(CheckServingTest, IsOkUntilTheServerStops) {
  const std::string address = server_->address();
  EXPECT_THAT(CheckServing(address, {}, kPatience), Succeeds());
  server_.reset();
  EXPECT_THAT(CheckServing(address, {}, kPatience), Fails(Code::kUnavailable, address));
}

TEST_F(CheckServingTest, AsksTheLoopbackOfAServerThatListensEverywhere) {
  const std::string everywhere = absl::StrCat("0.0.0.0:", server_->port());
  EXPECT_THAT(CheckServing(everywhere, {}, kPatience), Succeeds());
}

TEST_F(CheckServingTest, AsksNoProxyOfTheEnvironment) {
  setenv("http_proxy", "http://127.0.0.1:1", 1);  // where nobody listens
  const absl::Status status = CheckServing(server_->address(), {}, kPatience);
  unsetenv("http_proxy");
  EXPECT_THAT(status, Succeeds());
}

TEST_F(CheckServingTest, NeedsToKnowThePort) {
  for (const char* listen : {"127.0.0.1:0", "127.0.0.1:", "127.0.0.1"}) {
    EXPECT_THAT(CheckServing(listen, {}, kPatience), Fails(Code::kInvalidArgument, listen));
  }
}

TEST_F(CheckServingTest, SpeaksTlsAndNeedsNoAuthorityForIt) {
  EXPECT_THAT(StartAndCheck(Files(authority_.Sign("another name"), "")), Succeeds());
  EXPECT_THAT(CheckServing(server_->address(), {}, kPatience), Fails(Code::kUnavailable, ""));
}

TEST_F(CheckServingTest, ShowsTheServersCertificateWhereOneIsAskedFor) {
  EXPECT_THAT(StartAndCheck(Files(authority_.Sign("the server"), authority_.certificate())),
              Succeeds());
  const TestAuthority other("another authority");
  EXPECT_THAT(StartAndCheck(Files(authority_.Sign("the server"), other.certificate())),
              Fails(Code::kUnavailable, "failed to connect"));
}

}  // namespace
}  // namespace liquidblend::server::check_serving_test
