// While a store hangs, probes are answered all the same, and keep nobody else from being answered.
#include <atomic>
#include <memory>
#include <vector>

#include "absl/time/clock.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http {
namespace {

using testing::HasSubstr;

// Blobs of another store, which cannot be opened before Release().
class HangingBlobs final : public store::BlobStore {
 public:
  explicit HangingBlobs(store::BlobStore& blobs) : blobs_(blobs) {}
  ~HangingBlobs() override { Release(); }

  void Hang() { hangs_ = true; }
  void Release() {
    if (!release_.HasBeenNotified()) release_.Notify();
  }
  int num_opened() const { return num_opened_; }

  absl::StatusOr<std::shared_ptr<const store::Blob>> Open(const store::BlobId& id) override {
    ++num_opened_;
    if (hangs_) release_.WaitForNotification();
    return blobs_.Open(id);
  }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> Create() override { return blobs_.Create(); }
  absl::Status Verify(const store::BlobId& id) override { return blobs_.Verify(id); }
  absl::Status Delete(const store::BlobId& id) override { return blobs_.Delete(id); }
  absl::StatusOr<bool> DeleteIfNotNewer(const store::BlobId& id, absl::Time time) override {
    return blobs_.DeleteIfNotNewer(id, time);
  }
  absl::StatusOr<std::string> Quarantine(const store::BlobId& id) override {
    return blobs_.Quarantine(id);
  }
  absl::StatusOr<std::vector<store::BlobInfo>> List() override { return blobs_.List(); }

 private:
  store::BlobStore& blobs_;
  std::atomic<bool> hangs_ = false;
  std::atomic<int> num_opened_ = 0;
  absl::Notification release_;
};

class ProbesTest : public rpc::RpcTest {
 protected:
  void SetUp() override {
    PublishSplash();
    rpc::BackendsOptions options = SmallBackends();
    options.num_io_threads = 2;
    backends_ = std::make_unique<rpc::Backends>(*catalog_, hanging_, families_, options);
    source_ = rpc::MakeFrameSource(*backends_, entrance_);
    PortOptions port;
    port.listen = "127.0.0.1:0";
    port_ = *Port::Start(*source_, port);
  }

  ~ProbesTest() override {
    hanging_.Release();
    port_.reset();
    backends_->Stop();
    source_.reset();
  }

  HttpReply Get(const std::string& target) { return HttpClient(port_->port()).Get(target); }

  HangingBlobs hanging_{*blobs_};
  rpc::Authorizer everyone_;
  rpc::Entrance entrance_{everyone_};
  std::unique_ptr<rpc::Backends> backends_;
  std::unique_ptr<rpc::FrameSource> source_;
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
  EXPECT_THAT(Get("/metrics").body, HasSubstr("liquidblend_jobs"));
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
