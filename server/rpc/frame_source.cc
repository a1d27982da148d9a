#include "server/rpc/frame_source.h"

#include <map>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/ascii.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/open_store.h"
#include "server/rpc/backends.h"
#include "server/rpc/get_frame.h"
#include "server/rpc/guarded.h"
#include "server/rpc/handlers.h"

namespace liquidblend::rpc {
namespace {

constexpr absl::Duration kCountInterval = absl::Seconds(5);

// Runs what tells of an answer; whatever it throws must not end the thread.
template <typename Tell>
void Deliver(const Tell& tell) {
  const absl::Status delivered = Guarded([&] {
    tell();
    return absl::OkStatus();
  });
  if (!delivered.ok()) base::LogError("an answer is lost: " + delivered.ToString());
}

absl::StatusOr<v1::Frame> ToFrame(const absl::StatusOr<FramePtr>& made) {
  LB_RETURN_IF_ERROR(made.status());
  v1::Frame frame;
  if (!frame.ParseFromString(**made)) return absl::InternalError("a frame's bytes are no Frame");
  return frame;
}

class PooledSource final : public FrameSource {
 public:
  PooledSource(Backends& backends, Entrance& entrance) : backends_(backends), entrance_(entrance) {}

  absl::Status Admit(const Visitor& visitor, const Errand& errand, Admitted& admitted) override {
    return entrance_.Enter(visitor, errand, admitted);
  }

  Cancel GetFrame(v1::GetFrameRequest request, std::string client, Done<v1::Frame> done) override {
    const auto call =
        FrameCall::Start(backends_, request, std::move(client),
                         [done = std::move(done)](const absl::StatusOr<FramePtr>& made) mutable {
                           Deliver([&] { done(Guarded([&] { return ToFrame(made); })); });
                         });
    return [call] { call->Cancel(); };
  }
  void GetFamily(v1::GetFamilyRequest request, Done<v1::Family> done) override {
    Answer(
        backends_.io,
        [this, request = std::move(request)] { return rpc::GetFamily(backends_, request); },
        std::move(done));
  }
  void ListFamilies(v1::ListFamiliesRequest request, Done<v1::ListFamiliesResponse> done) override {
    Answer(
        backends_.io,
        [this, request = std::move(request)] { return rpc::ListFamilies(backends_, request); },
        std::move(done));
  }
  std::shared_ptr<StreamSession> OpenStream(std::string client,
                                            std::weak_ptr<StreamSession::Sink> sink) override {
    return std::make_shared<StreamSession>(backends_, std::move(client), std::move(sink));
  }
  void CheckStores(Done<std::string> done) override {
    Answer(
        backends_.io, [this] { return LookAtStores(); }, std::move(done));
  }
  void GetMetricsText(Done<std::string> done) override {
    Answer(
        backends_.io,
        [this]() -> absl::StatusOr<std::string> { return backends_.metrics.Text(TakeSnapshot()); },
        std::move(done));
  }
  metrics::Metrics& metrics() override { return backends_.metrics; }
  CallLog& call_log() override { return backends_.call_log; }

 private:
  // done(work()) on the pool.
  template <typename Work, typename Reply>
  void Answer(WorkPool& pool, Work work, Done<Reply> done) {
    const auto call =
        std::make_shared<std::pair<Work, Done<Reply>>>(std::move(work), std::move(done));
    const absl::Status accepted =
        pool.Post([call] { Deliver([&] { call->second(Guarded(call->first)); }); });
    if (!accepted.ok()) call->second(accepted);
  }

  absl::StatusOr<std::string> LookAtStores() {
    LB_RETURN_IF_ERROR(store::CheckReachable(backends_.catalog, backends_.blobs));
    return "ok";
  }

  metrics::Snapshot TakeSnapshot() {
    metrics::Snapshot snapshot;
    snapshot.family_bytes = backends_.families.SizesBytes();
    snapshot.waiting_calls = {{"io", backends_.io.num_waiting()},
                              {"loads", backends_.loads.num_waiting()}};
    const FrameCache::Stats cache = backends_.frame_cache.stats();
    snapshot.frame_cache = {cache.num_hits, cache.num_misses, cache.num_frames, cache.size_bytes};
    const FramePool::Stats queue = backends_.frames.stats();
    snapshot.frame_queue = {queue.waiting_cost, queue.num_refused};
    absl::MutexLock lock(&mutex_);
    if (absl::Now() - counted_at_ > kCountInterval) CountJobs();
    snapshot.jobs = jobs_;
    snapshot.workers = workers_;
    return snapshot;
  }

  void CountJobs() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    counted_at_ = absl::Now();
    jobs_.clear();
    workers_.clear();
    const absl::StatusOr<store::JobCounts> counts = backends_.catalog.CountJobs();
    if (!counts.ok()) return base::LogWarning("metrics: jobs: " + counts.status().ToString());
    for (const auto& [state, count] : *counts) {
      jobs_[absl::AsciiStrToLower(store::pb::JobRecord::State_Name(state))] = count;
    }
    jobs_.try_emplace("queued", 0);
    jobs_.try_emplace("running", 0);
    CountWorkers();
  }

  void CountWorkers() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const auto workers = backends_.catalog.ListWorkers();
    if (!workers.ok()) return base::LogWarning("metrics: workers: " + workers.status().ToString());
    workers_ = {{"ready", 0}, {"refused", 0}};
    for (const store::pb::WorkerRecord& worker : *workers) {
      ++workers_[worker.refusal().empty() ? "ready" : "refused"];
    }
  }

  Backends& backends_;
  Entrance& entrance_;
  absl::Mutex mutex_;
  absl::Time counted_at_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
  std::map<std::string, int64_t> jobs_ ABSL_GUARDED_BY(mutex_);     // by state
  std::map<std::string, int64_t> workers_ ABSL_GUARDED_BY(mutex_);  // by state
};

}  // namespace

std::unique_ptr<FrameSource> MakeFrameSource(Backends& backends, Entrance& entrance) {
  return std::make_unique<PooledSource>(backends, entrance);
}

}  // namespace liquidblend::rpc
