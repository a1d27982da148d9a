#include "server/metrics/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <array>
#include <set>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "core/base/version.h"
#include "server/metrics/metric_families.h"
#include "server/metrics/snapshot_families.h"

namespace liquidblend::metrics {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::MetricFamily;
using Buckets = Histogram::BucketBoundaries;

constexpr size_t kMaxFamilies = 256;
constexpr std::array kStageNames = {"queue", "slice", "finish", "encode", "write"};
constexpr std::array kConnectionKinds = {"http", "websocket"};
constexpr std::array kJobKinds = {"import", "registration"};
constexpr std::array kJobPhases = {"wait", "work"};
constexpr std::array kFailures = {"error", "worker_lost"};
constexpr int kNumCodes = static_cast<int>(absl::StatusCode::kUnauthenticated) + 1;

// Seconds. Stages of frames take from a tenth of a millisecond; 1/60 s is the period of a fast
// stream.
Buckets StageBuckets() {
  return {1e-4,    2.5e-4,   5e-4,   1e-3, 2e-3, 3e-3, 5e-3, 7.5e-3, 1e-2,
          1.25e-2, 1.0 / 60, 2.5e-2, 5e-2, 0.1,  0.25, 0.5,  1,      5};
}
Buckets RequestBuckets() {
  return {1e-3, 2.5e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 60, 600};
}

// Jobs take from seconds to hours.
Buckets JobBuckets() { return {1, 2.5, 5, 10, 30, 60, 120, 300, 600, 1800, 3600, 3 * 3600, 86400}; }

Family<Counter>& Counters(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Family<Histogram>& Histograms(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

prometheus::Labels JobLabels(absl::string_view kind, absl::StatusCode code) {
  return {{"kind", std::string(kind)}, {"code", absl::StatusCodeToString(code)}};
}

MetricFamily BuildInfo() {
  return Gauges("liquidblend_build_info", "1; the program's version is a label", "version",
                {{base::Version(), 1}});
}

}  // namespace

struct Metrics::Impl {
  // The families are as many as users register; Prometheus must not drown in them.
  std::string FamilyLabel(const std::string& family) {
    absl::MutexLock lock(&mutex);
    if (known_families.contains(family)) return family;
    if (known_families.size() >= kMaxFamilies) return "other";
    known_families.insert(family);
    return family;
  }

  Histogram& JobSeconds(const std::string& kind, const char* phase) {
    return job_seconds.Add({{"kind", kind}, {"phase", phase}}, JobBuckets());
  }

  prometheus::Registry registry;
  absl::Mutex mutex;
  std::set<std::string> known_families ABSL_GUARDED_BY(mutex);

  Family<Counter>& frames =
      Counters(registry, "liquidblend_frames_total", "Frames made, by family and preset");
  Family<Counter>& frame_bytes = Counters(registry, "liquidblend_frame_bytes_total",
                                          "Bytes of the frames made, by family and preset");
  Family<Counter>& dropped =
      Counters(registry, "liquidblend_frames_dropped_total",
               "Frames that streams skipped because they would have been late, by family");
  Family<Histogram>& stage_seconds =
      Histograms(registry, "liquidblend_frame_stage_seconds", "How long a stage of a frame took");
  std::vector<Histogram*> stages;
  Family<Counter>& requests = Counters(registry, "liquidblend_requests_total",
                                       "Calls answered, by protocol, method and code");
  Family<Histogram>& request_seconds = Histograms(
      registry, "liquidblend_request_seconds",
      "How long calls took, by protocol and method; streams from their begin to their end");
  Family<Gauge>& connections = prometheus::BuildGauge()
                                   .Name("liquidblend_http_connections")
                                   .Help("Connections of the HTTP port, by kind")
                                   .Register(registry);
  std::array<Gauge*, kConnectionKinds.size()> connections_of = {};  // of each kind
  Counter& refused_connections =
      Counters(registry, "liquidblend_http_connections_refused_total",
               "Connections that the HTTP port closed at once because there were too many")
          .Add({});
  Gauge& streams = prometheus::BuildGauge()
                       .Name("liquidblend_streams")
                       .Help("Streams of frames that are open")
                       .Register(registry)
                       .Add({});
  Family<Counter>& jobs =
      Counters(registry, "liquidblend_jobs_ended_total", "Jobs that have ended, by kind and code");
  Family<Counter>& failed_attempts =
      Counters(registry, "liquidblend_job_attempts_failed_total",
               "Attempts that failed of jobs that have ended, by kind and reason");
  Family<Histogram>& job_seconds = Histograms(
      registry, "liquidblend_job_seconds",
      "How long jobs that have ended waited until their work began, and worked from then on");
  Family<Counter>& collections =
      Counters(registry, "liquidblend_collections_total",
               "Collections of unreferenced blobs by this server, by result");
  Counter& collected_blobs = Counters(registry, "liquidblend_collected_blobs_total",
                                      "Unreferenced blobs that this server deleted")
                                 .Add({});
  Counter& collected_bytes = Counters(registry, "liquidblend_collected_bytes_total",
                                      "Bytes of the unreferenced blobs that this server deleted")
                                 .Add({});
  const absl::Time start = absl::Now();
};

// Counters begin at zero: in the first value of a counter, Prometheus sees no growth.
Metrics::Metrics() : impl_(std::make_unique<Impl>()) {
  for (const char* name : kStageNames) {
    impl_->stages.push_back(&impl_->stage_seconds.Add({{"stage", name}}, StageBuckets()));
  }
  for (size_t k = 0; k < kConnectionKinds.size(); ++k) {
    impl_->connections_of[k] = &impl_->connections.Add({{"kind", kConnectionKinds[k]}});
  }
  for (const char* kind : kJobKinds) {
    for (int code = 0; code < kNumCodes; ++code) {
      impl_->jobs.Add(JobLabels(kind, static_cast<absl::StatusCode>(code)));
    }
    for (const char* reason : kFailures) {
      impl_->failed_attempts.Add({{"kind", kind}, {"reason", reason}});
    }
    for (const char* phase : kJobPhases) impl_->JobSeconds(kind, phase);
  }
  for (const char* result : {"ok", "failed"}) impl_->collections.Add({{"result", result}});
}

Metrics::~Metrics() = default;

void Metrics::CountFrame(const std::string& family, absl::string_view preset, size_t num_bytes,
                         const StageTimes& times) {
  const std::string label = impl_->FamilyLabel(family);
  const prometheus::Labels labels = {{"family", label}, {"preset", std::string(preset)}};
  impl_->frames.Add(labels).Increment();
  impl_->dropped.Add({{"family", label}});
  impl_->frame_bytes.Add(labels).Increment(static_cast<double>(num_bytes));
  ObserveStage(Stage::kSlice, times.slice);
  ObserveStage(Stage::kFinish, times.finish);
  ObserveStage(Stage::kEncode, times.encode);
}

void Metrics::CountDroppedFrames(const std::string& family, int64_t num_frames) {
  Counter& counter = impl_->dropped.Add({{"family", impl_->FamilyLabel(family)}});
  counter.Increment(static_cast<double>(num_frames));
}

void Metrics::ObserveStage(Stage stage, absl::Duration duration) {
  impl_->stages[static_cast<size_t>(stage)]->Observe(absl::ToDoubleSeconds(duration));
}

void Metrics::CountRequest(const Answered& answered) {
  prometheus::Labels labels = {{"protocol", std::string(answered.protocol)},
                               {"method", std::string(answered.method)}};
  Histogram& seconds = impl_->request_seconds.Add(labels, RequestBuckets());
  seconds.Observe(absl::ToDoubleSeconds(answered.duration));
  labels["code"] = std::string(answered.code);
  impl_->requests.Add(labels).Increment();
}

void Metrics::AddConnections(absl::string_view kind, int change) noexcept {
  for (size_t k = 0; k < kConnectionKinds.size(); ++k) {
    if (kind == kConnectionKinds[k]) impl_->connections_of[k]->Increment(change);
  }
}

void Metrics::CountRefusedConnection() { impl_->refused_connections.Increment(); }

void Metrics::AddStreams(int change) { impl_->streams.Increment(change); }

void Metrics::CountJob(const EndedJob& job) {
  const std::string kind(job.kind);
  impl_->jobs.Add(JobLabels(kind, job.code)).Increment();
  const auto observe = [&](const char* phase, const std::optional<absl::Duration>& duration) {
    if (!duration.has_value()) return;
    impl_->JobSeconds(kind, phase).Observe(absl::ToDoubleSeconds(*duration));
  };
  observe("wait", job.waited);
  observe("work", job.worked);
  const auto count = [&](const char* reason, int64_t number) {
    impl_->failed_attempts.Add({{"kind", kind}, {"reason", reason}})
        .Increment(static_cast<double>(number));
  };
  count("worker_lost", job.num_lost);
  count("error", job.num_failed);
}

void Metrics::CountCollection(const Collection& collection) {
  impl_->collections.Add({{"result", collection.is_ok ? "ok" : "failed"}}).Increment();
  impl_->collected_blobs.Increment(static_cast<double>(collection.num_blobs));
  impl_->collected_bytes.Increment(static_cast<double>(collection.num_bytes));
}

std::string Metrics::Text(const Snapshot& snapshot) const {
  std::vector<MetricFamily> all = impl_->registry.Collect();
  AddSnapshot(snapshot, all);
  AddProcess(all);
  all.push_back(OneGauge("process_start_time_seconds", "When the process started, Unix time",
                         absl::ToDoubleSeconds(impl_->start - absl::UnixEpoch())));
  all.push_back(BuildInfo());
  return prometheus::TextSerializer().Serialize(all);
}

}  // namespace liquidblend::metrics
