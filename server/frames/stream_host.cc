#include "server/frames/stream_host.h"

#include <utility>

#include "server/base/work_pool.h"
#include "server/frames/find_family.h"

namespace liquidblend::server {
namespace {

class BackendsHost final : public StreamHost {
 public:
  explicit BackendsHost(Backends& backends) : backends_(backends) {
    backends_.metrics.AddStreams(1);
  }
  ~BackendsHost() override { backends_.metrics.AddStreams(-1); }
  BackendsHost(const BackendsHost&) = delete;
  BackendsHost& operator=(const BackendsHost&) = delete;

  absl::Duration Now() const override { return SteadyNow(); }
  void Post(Task task) override { backends_.steps.PostMore(std::move(task)); }
  Timer StartTimer(absl::Duration delay, Task task) override {
    const auto timer = backends_.steps.StartTimer(delay, std::move(task));
    return timer.has_value() ? std::make_shared<WorkPool::Timer>(*timer) : nullptr;
  }
  void Cancel(const Timer& timer) override {
    if (timer != nullptr) backends_.steps.Cancel(*std::static_pointer_cast<WorkPool::Timer>(timer));
  }
  void FindFamily(const std::string& id, catalog::AskedVersion asked,
                  catalog::Families::Done done) override {
    server::FindFamily(backends_, id, asked, std::move(done));
  }
  Ticket Make(FrameOrder order, FrameMaker::Done done) override {
    return backends_.maker.Make(std::move(order), std::move(done));
  }
  void Leave(const Ticket& ticket) override {
    backends_.maker.Leave(std::static_pointer_cast<FrameMaker::Waiter>(ticket));
  }
  absl::StatusOr<FramePtr> Hold(FramePtr frame,
                                const std::shared_ptr<UnreadAnswers::Reader>& reader) override {
    return backends_.unread.Hold(std::move(frame), reader, Now());
  }
  int64_t max_stream_bytes() const override { return backends_.limits.max_stream_bytes; }
  void CountDroppedFrames(const std::string& family, int64_t count) override {
    backends_.metrics.CountDroppedFrames(family, count);
  }

 private:
  Backends& backends_;
};

}  // namespace

std::shared_ptr<StreamHost> MakeStreamHost(Backends& backends) {
  return std::make_shared<BackendsHost>(backends);
}

}  // namespace liquidblend::server
