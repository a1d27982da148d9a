// A port over a store with two small families in it.
#pragma once

#include <memory>
#include <string>

#include "absl/synchronization/notification.h"
#include "server/http/port.h"
#include "server/rpc/backends.h"
#include "server/rpc/find_family.h"
#include "server/rpc/frame_source.h"
#include "tests/server/http/http_client.h"
#include "tests/server/rpc/rpc_testing.h"

namespace liquidblend::http {

class PortTest : public rpc::RpcTest {
 protected:
  PortTest()
      : backends_(*catalog_, *blobs_, families_, Options()),
        source_(rpc::MakeFrameSource(backends_, entrance_)) {
    rpc::KeepFamiliesFresh(backends_);  // as a server does
  }
  ~PortTest() override {
    port_.reset();
    backends_.Stop();
  }

  static rpc::BackendsOptions Options() {
    rpc::BackendsOptions options = SmallBackends();
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
    auto port = Port::Start(*source_, options);
    ASSERT_TRUE(port.ok()) << port.status();
    port_ = *std::move(port);
  }

  std::string MetricsText() { return HttpClient(port_->port()).Get("/metrics").body; }

  // Keeps the pool's only thread busy until the release.
  void OccupyFrames() {
    absl::Notification begun;
    rpc::FrameWork work;
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
  rpc::Authorizer everyone_;
  rpc::Entrance entrance_{everyone_};
  rpc::Backends backends_;
  std::unique_ptr<rpc::FrameSource> source_;
  std::unique_ptr<Port> port_;
};

}  // namespace liquidblend::http
