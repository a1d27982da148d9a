// While a store hangs, probes are answered all the same, and keep nobody else from being answered.
#include <memory>
#include <vector>

#include "absl/time/clock.h"
#include "tests/server/hanging_blobs.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http {
namespace {

using testing::HasSubstr;

class ProbesTest : public server::RpcTest {
 protected:
  void SetUp() override {
    PublishSplash();
    server::BackendsOptions options = SmallBackends();
    options.num_io_threads = 2;
    backends_ = std::make_unique<server::Backends>(*catalog_, hanging_, families_, options);
    api_ = server::MakeApi(*backends_, access_controller_, import_roots_);
    PortOptions port;
    port.listen = "127.0.0.1:0";
    port_ = *Port::Start(*api_, port);
  }

  ~ProbesTest() override {
    hanging_.Release();
    port_.reset();
    backends_->Stop();
    api_.reset();
  }

  HttpReply Get(const std::string& target) { return HttpClient(port_->port()).Get(target); }

  server::HangingBlobs hanging_{*blobs_};
  server::Authorizer everyone_;
  server::AccessController access_controller_{everyone_};
  server::ImportRoots import_roots_;
  std::unique_ptr<server::Backends> backends_;
  std::unique_ptr<server::Api> api_;
  std::unique_ptr<Port> port_;
};

TEST_F(ProbesTest, AnswersAreShared) {
  for (int k = 0; k < 20; ++k) EXPECT_EQ(Get("/readyz").code, 200);
  // Of 20 in a row, which take far less than a second on most machines.
  EXPECT_LE(hanging_.num_opened(), 10);
}

TEST_F(ProbesTest, AStoreThatHangsStopsNobodyElse) {
  hanging_.Hang();
  std::vector<std::unique_ptr<HttpClient>> probes;
  for (int k = 0; k < 10; ++k) {
    probes.push_back(std::make_unique<HttpClient>(port_->port()));
    ASSERT_TRUE(probes.back()->Send("GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  }
  EXPECT_EQ(Get("/v1/families").code, 200);
  EXPECT_EQ(Get("/v1/families/splash").code, 200);
  EXPECT_EQ(Get("/healthz").code, 200);
  const std::string metrics = Get("/metrics").body;
  EXPECT_THAT(metrics, HasSubstr("liquidblend_jobs"));
  EXPECT_THAT(metrics, HasSubstr("liquidblend_store_reachable{store=\"catalog\"} 1\n"));
  EXPECT_THAT(metrics, HasSubstr("liquidblend_store_reachable{store=\"blobs\"} 0\n"));
  for (const auto& probe : probes) {
    const HttpReply reply = probe->ReadReply();
    EXPECT_EQ(reply.code, 503);
    EXPECT_THAT(reply.body, HasSubstr("has not answered within 2s"));
  }
  EXPECT_EQ(Get("/readyz").code, 503);
  EXPECT_EQ(hanging_.num_opened(), 1);
  hanging_.Release();
  const absl::Time give_up = absl::Now() + absl::Seconds(20);
  while (Get("/readyz").code != 200) ASSERT_LT(absl::Now(), give_up);
}

}  // namespace
}  // namespace liquidblend::http
