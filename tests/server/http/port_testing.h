// A port over a store with two small families in it.
#pragma once

#include <memory>
#include <string>

#include "absl/synchronization/notification.h"
#include "server/api/api.h"
#include "server/frames/backends.h"
#include "server/frames/find_family.h"
#include "server/http/port.h"
#include "tests/server/backends_testing.h"
#include "tests/server/http/http_client.h"

namespace liquidblend::http {

class PortTest : public server::RpcTest {
 protected:
  explicit PortTest(const server::BackendsOptions& options = Options())
      : backends_(*catalog_, *blobs_, families_, options),
        api_(server::MakeApi(backends_, access_controller_, import_roots_)) {
    server::KeepFamiliesFresh(backends_);  // as a server does
  }
  ~PortTest() override {
    port_.reset();
    backends_.Stop();
  }

  static server::BackendsOptions Options() {
    server::BackendsOptions options = SmallBackends();
    options.num_io_threads = 2;
    return options;
  }

  void SetUp() override {
    PublishSplash();
    PublishFamily("drops", "a", "b", 2);
    Start({});
  }

  void Start(PortOptions options) {
    port_.reset();
    options.listen = "127.0.0.1:0";
    auto port = Port::Start(*api_, options);
    ASSERT_TRUE(port.ok()) << port.status();
    port_ = *std::move(port);
  }

  std::string MetricsText() { return HttpClient(port_->port()).Get("/metrics").body; }

  // Keeps the pool's only thread busy until the release.
  void OccupyFrames() {
    absl::Notification begun;
    server::FrameWork work;
    work.client = "occupier";
    work.run = [&] {
      begun.Notify();
      release_.WaitForNotification();
    };
    ASSERT_TRUE(backends_.frames.Post(std::move(work), false).ok());
    begun.WaitForNotification();
  }

  int64_t WaitingCost() const { return backends_.frames.stats().waiting_cost; }

  absl::Notification release_;  // of the thread that is occupied, which may be slow to notice
  server::Authorizer everyone_;
  server::AccessController access_controller_{everyone_};
  server::ImportRoots import_roots_;
  server::Backends backends_;
  std::unique_ptr<server::Api> api_;
  std::unique_ptr<Port> port_;
};

}  // namespace liquidblend::http
