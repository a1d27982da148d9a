// Who may have what over HTTP.
#include <fstream>
#include <map>
#include <thread>

#include "absl/strings/escaping.h"
#include "core/base/log.h"
#include "server/access/token_file.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http::access_test {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr char kSplash[] = "/v1/families/splash/frame.drc?weights=0.5&version=1";

// "frames" and "write" have the scope of that name, "write" may store a megabyte, "narrow" has one
// stream at a time.
class AccessTest : public PortTest {
 protected:
  void SetUp() override {
    PublishSplash();
    std::string entries;
    for (const char* name : {"frames", "write", "narrow"}) {
      const std::string scope = name == std::string("write") ? "write" : "frames";
      server::NewToken made = *server::MakeToken(name, {scope});
      if (name == std::string("narrow")) {
        made.entry.insert(made.entry.size() - 1, R"(, "limits": {"max_streams": 1})");
      }
      if (name == std::string("write")) {
        made.entry.insert(made.entry.size() - 1, R"(, "limits": {"max_stored_bytes": 1000000})");
      }
      tokens_[name] = made.token;
      headers_[name] = absl::StrCat("Authorization: Bearer ", made.token, "\r\n");
      absl::StrAppend(&entries, entries.empty() ? "" : ",", made.entry);
    }
    const std::string path = folder_.path() + "/tokens.json";
    std::ofstream(path) << R"({"principals": [)" << entries << "]}";
    authorizer_ = *server::Authorizer::Open(path);
    guarded_ = std::make_unique<server::AccessController>(*authorizer_);
    api_ = server::MakeApi(backends_, *guarded_, import_roots_);
    Start({});
  }
  ~AccessTest() override { port_.reset(); }

  HttpReply Get(const std::string& target, const std::string& as) {
    return HttpClient(port_->port()).Get(target, headers_[as]);
  }

  std::map<std::string, std::string> headers_;
  std::map<std::string, std::string> tokens_;
  std::unique_ptr<server::Authorizer> authorizer_;
  std::unique_ptr<server::AccessController> guarded_;
};

TEST_F(AccessTest, MetricsShowTheLimitsOfPrincipals) {
  const std::string text = Get("/metrics", "frames").body;
  EXPECT_THAT(text, HasSubstr("liquidblend_owner_max_stored_bytes{owner=\"write\"} 1000000\n"));
  EXPECT_THAT(text, HasSubstr("liquidblend_owner_stored_bytes{owner=\"write\"} 0\n"));
  EXPECT_THAT(text, Not(HasSubstr("liquidblend_owner_max_stored_bytes{owner=\"frames\"}")));
}

TEST_F(AccessTest, TokensCountAsOverGrpc) {
  for (const char* target : {kSplash, "/v1/families", "/metrics"}) {
    EXPECT_EQ(Get(target, "").code, 401) << target;
    EXPECT_THAT(Get(target, "").body, HasSubstr("TOKEN_MISSING"));
  }
  HttpReply frame = Get(kSplash, "frames");
  EXPECT_EQ(frame.code, 200);
  EXPECT_EQ(frame.headers["cache-control"], "private, immutable, max-age=31536000");
  EXPECT_EQ(Get(kSplash, "write").code, 403);
  EXPECT_THAT(Get(kSplash, "write").body, HasSubstr("SCOPE_MISSING"));
  EXPECT_EQ(Get("/v1/families", "write").code, 200);
  EXPECT_EQ(Get("/healthz", "").code, 200);
}

TEST_F(AccessTest, AWebSocketCountsAsAStreamUntilItEnds) {
  {
    HttpClient first(port_->port());
    EXPECT_EQ(first.Upgrade(headers_["narrow"]).code, 101);
    const HttpReply refused = HttpClient(port_->port()).Upgrade(headers_["narrow"]);
    EXPECT_EQ(refused.code, 429);
    EXPECT_THAT(refused.body, HasSubstr("TOO_MANY_STREAMS"));
    EXPECT_EQ(HttpClient(port_->port()).Upgrade(headers_["write"]).code, 403);
    EXPECT_EQ(HttpClient(port_->port()).Upgrade().code, 401);
  }
  int code = 429;
  while (code == 429) {
    std::this_thread::yield();
    code = HttpClient(port_->port()).Upgrade(headers_["narrow"]).code;
  }
  EXPECT_EQ(code, 101);
}

// As a page opens it, which cannot set a header.
TEST_F(AccessTest, AWebSocketsTokenMayComeAsASubprotocol) {
  base::StartLog("server", base::LogLevel::kDebug, base::LogFormat::kText);
  testing::internal::CaptureStderr();
  const std::string offer =
      absl::StrCat("Sec-WebSocket-Protocol: liquidblend.v1, ", "liquidblend.bearer.");
  const auto upgrade = [&](const std::string& token, const std::string& more = "") {
    return HttpClient(port_->port())
        .Upgrade(absl::StrCat(offer, absl::WebSafeBase64Escape(token), "\r\n", more));
  };
  HttpReply reply = upgrade(tokens_["frames"]);
  EXPECT_EQ(reply.code, 101);
  EXPECT_EQ(reply.headers["sec-websocket-protocol"], "liquidblend.v1");
  EXPECT_EQ(upgrade(tokens_["write"]).code, 403);
  EXPECT_THAT(upgrade("guess").body, HasSubstr("TOKEN_UNKNOWN"));
  EXPECT_EQ(upgrade(tokens_["frames"], headers_["write"]).code, 403) << "the header wins";
  reply = HttpClient(port_->port()).Upgrade(headers_["frames"]);
  EXPECT_EQ(reply.code, 101);
  EXPECT_FALSE(reply.headers.contains("sec-websocket-protocol"));
  port_.reset();
  const std::string log = testing::internal::GetCapturedStderr();
  for (const auto& [name, token] : tokens_) {
    EXPECT_THAT(log, Not(HasSubstr(token)));
    EXPECT_THAT(log, Not(HasSubstr(absl::WebSafeBase64Escape(token))));
  }
}

}  // namespace
}  // namespace liquidblend::http::access_test
