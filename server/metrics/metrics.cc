#include "server/metrics/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <array>
#include <set>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "server/metrics/process.h"

namespace liquidblend::metrics {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Buckets = Histogram::BucketBoundaries;

constexpr size_t kMaxFamilies = 256;
constexpr std::array kStageNames = {"queue", "slice", "finish", "encode", "write"};

// Seconds. Stages of frames take from a tenth of a millisecond; 1/60 s is the period of a fast
// stream.
Buckets StageBuckets() {
  return {1e-4,    2.5e-4,   5e-4,   1e-3, 2e-3, 3e-3, 5e-3, 7.5e-3, 1e-2,
          1.25e-2, 1.0 / 60, 2.5e-2, 5e-2, 0.1,  0.25, 0.5,  1,      5};
}
Buckets RequestBuckets() {
  return {1e-3, 2.5e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 60, 600};
}

Family<Counter>& Counters(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

Family<Histogram>& Histograms(prometheus::Registry& registry, const char* name, const char* help) {
  return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
}

// A counter or gauge whose values are known now; an empty label means that there is one value.
MetricFamily Values(MetricType type, std::string name, std::string help, const std::string& label,
                    const std::map<std::string, double>& values) {
  MetricFamily family{std::move(name), std::move(help), type, {}};
  for (const auto& [key, value] : values) {
    prometheus::ClientMetric metric;
    if (!label.empty()) metric.label.push_back({label, key});
    (type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
    family.metric.push_back(std::move(metric));
  }
  return family;
}

MetricFamily OneGauge(std::string name, std::string help, double value) {
  return Values(MetricType::Gauge, std::move(name), std::move(help), "", {{"", value}});
}

MetricFamily OneCounter(std::string name, std::string help, double value) {
  return Values(MetricType::Counter, std::move(name), std::move(help), "", {{"", value}});
}

MetricFamily CountersOf(std::string name, std::string help, const std::string& label,
                        const std::map<std::string, int64_t>& values) {
  return Values(MetricType::Counter, std::move(name), std::move(help), label,
                {values.begin(), values.end()});
}

MetricFamily Gauges(std::string name, std::string help, const std::string& label,
                    const std::map<std::string, int64_t>& values) {
  return Values(MetricType::Gauge, std::move(name), std::move(help), label,
                {values.begin(), values.end()});
}

// Adds the figures of the catalog.
void AddCatalog(const CatalogFigures& now, std::vector<MetricFamily>& all) {
  all.push_back(Gauges("liquidblend_jobs", "Jobs and parts of jobs in the catalog, by state",
                       "state", now.jobs));
  MetricFamily within{"liquidblend_jobs_within_memory",
                      "Jobs of a state that a worker with so much memory may take",
                      MetricType::Gauge,
                      {}};
  for (const auto& [state, counts] : now.jobs_within_memory) {
    MetricFamily of_state = Gauges("", "", "memory", counts);
    for (prometheus::ClientMetric& metric : of_state.metric) {
      metric.label.push_back({"state", state});
      within.metric.push_back(std::move(metric));
    }
  }
  all.push_back(std::move(within));
  all.push_back(Gauges("liquidblend_workers",
                       "Workers seen within two minutes, by whether they take jobs", "state",
                       now.workers));
}

void AddSnapshot(const Snapshot& now, std::vector<MetricFamily>& all) {
  all.push_back(Gauges("liquidblend_family_bytes",
                       "Memory of a loaded family, mapped file included", "family",
                       now.family_bytes));
  all.push_back(OneGauge("liquidblend_families_loaded", "Families that are loaded",
                         static_cast<double>(now.family_bytes.size())));
  AddCatalog(now.catalog, all);
  all.push_back(Gauges("liquidblend_disk_free_bytes", "Free space that the server may use", "disk",
                       now.disk_free_bytes));
  all.push_back(Gauges("liquidblend_disk_size_bytes", "Size of the store's disk", "disk",
                       now.disk_size_bytes));
  all.push_back(Gauges("liquidblend_waiting_calls", "Calls that wait for a thread of a pool",
                       "pool", now.waiting_calls));
  all.push_back(OneGauge("liquidblend_frame_queue_cells",
                         "Cells that are expected to be sliced for frames that wait to be made",
                         static_cast<double>(now.frame_queue.waiting_cells)));
  all.push_back(OneCounter("liquidblend_frames_refused_total",
                           "Frames that were refused because too many waited",
                           static_cast<double>(now.frame_queue.num_refused)));
  const Snapshot::Cache& cache = now.frame_cache;
  all.push_back(OneCounter("liquidblend_frame_cache_hits_total", "Frames found in the cache",
                           static_cast<double>(cache.num_hits)));
  all.push_back(OneCounter("liquidblend_frame_cache_misses_total",
                           "Frames looked for in the cache and not found",
                           static_cast<double>(cache.num_misses)));
  all.push_back(OneGauge("liquidblend_frame_cache_frames", "Encoded frames held in the cache",
                         static_cast<double>(cache.num_frames)));
  all.push_back(OneGauge("liquidblend_frame_cache_bytes", "Memory of the frames held in the cache",
                         static_cast<double>(cache.num_bytes)));
  all.push_back(OneCounter("liquidblend_spans_exported_total", "Spans of traces that were exported",
                           static_cast<double>(now.spans.num_exported)));
  all.push_back(CountersOf("liquidblend_spans_dropped_total",
                           "Spans of traces that were not exported, by what left them out",
                           "reason", now.spans.dropped));
}

// By the names that all programs use.
void AddProcess(std::vector<MetricFamily>& all) {
  const ProcessFigures now = ReadProcessFigures();
  all.push_back(OneGauge("process_resident_memory_bytes", "Resident memory",
                         static_cast<double>(now.resident_bytes)));
  all.push_back(OneGauge("process_virtual_memory_bytes", "Virtual memory",
                         static_cast<double>(now.virtual_bytes)));
  all.push_back(Gauges("liquidblend_heap_bytes",
                       "Memory that is allocated, and that was freed and is kept", "state",
                       {{"used", static_cast<double>(now.heap.used)},
                        {"free", static_cast<double>(now.heap.free)}}));
  all.push_back(
      OneCounter("process_cpu_seconds_total", "User and system time, in seconds", now.cpu_s));
  all.push_back(OneGauge("process_open_fds", "Open file descriptors",
                         static_cast<double>(now.num_open_files)));
  all.push_back(OneGauge("process_max_fds", "Most file descriptors that may be open",
                         static_cast<double>(now.max_open_files)));
  all.push_back(OneGauge("process_threads", "Threads", static_cast<double>(now.num_threads)));
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
  Counter& refused_connections =
      Counters(registry, "liquidblend_http_connections_refused_total",
               "Connections that the HTTP port closed at once because there were too many")
          .Add({});
};

Metrics::Metrics() : impl_(std::make_unique<Impl>()) {
  for (const char* name : kStageNames) {
    impl_->stages.push_back(&impl_->stage_seconds.Add({{"stage", name}}, StageBuckets()));
  }
}

Metrics::~Metrics() = default;

void Metrics::CountFrame(const std::string& family, absl::string_view preset, size_t num_bytes,
                         const StageTimes& times) {
  const prometheus::Labels labels = {{"family", impl_->FamilyLabel(family)},
                                     {"preset", std::string(preset)}};
  impl_->frames.Add(labels).Increment();
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

void Metrics::AddConnections(absl::string_view kind, int change) {
  impl_->connections.Add({{"kind", std::string(kind)}}).Increment(change);
}

void Metrics::CountRefusedConnection() { impl_->refused_connections.Increment(); }

std::string Metrics::Text(const Snapshot& snapshot) const {
  std::vector<MetricFamily> all = impl_->registry.Collect();
  AddSnapshot(snapshot, all);
  AddProcess(all);
  return prometheus::TextSerializer().Serialize(all);
}

}  // namespace liquidblend::metrics
