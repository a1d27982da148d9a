#include "server/metrics/snapshot_families.h"

#include <optional>
#include <utility>

#include "server/metrics/metric_families.h"
#include "server/metrics/process.h"

namespace liquidblend::metrics {
namespace {

using prometheus::MetricFamily;
using prometheus::MetricType;

MetricFamily JobsWithinMemory(const CatalogFigures& now) {
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
  return within;
}

void AddCatalog(const CatalogFigures& now, std::vector<MetricFamily>& all) {
  all.push_back(Gauges("liquidblend_jobs", "Jobs and parts of jobs in the catalog, by state",
                       "state", now.jobs));
  all.push_back(JobsWithinMemory(now));
  all.push_back(OneGauge("liquidblend_jobs_paused",
                         "Queued jobs in the pause after a failed attempt",
                         static_cast<double>(now.queue.num_paused)));
  all.push_back(OneGauge("liquidblend_jobs_too_large",
                         "Queued jobs that need more memory than any worker has",
                         static_cast<double>(now.queue.num_too_large)));
  all.push_back(OneGauge("liquidblend_oldest_queued_job_seconds",
                         "Since the oldest queued job was queued, without jobs in a pause",
                         absl::ToDoubleSeconds(now.queue.oldest_wait)));
  all.push_back(Gauges("liquidblend_workers",
                       "Workers seen within two minutes, by whether they take jobs", "state",
                       now.workers));
}

// Without the owners that have no value.
MetricFamily OfOwners(std::string name, std::string help, const std::vector<OwnerFigures>& owners,
                      std::optional<int64_t> (*value)(const OwnerFigures&)) {
  std::map<std::string, int64_t> values;
  for (const OwnerFigures& owner : owners) {
    if (const std::optional<int64_t> figure = value(owner)) values[owner.owner] = *figure;
  }
  return Gauges(std::move(name), std::move(help), "owner", values);
}

std::optional<int64_t> UnlessZero(int64_t limit) {
  return limit == 0 ? std::nullopt : std::optional(limit);
}

void AddOwners(const Snapshot& now, std::vector<MetricFamily>& all) {
  using Value = std::optional<int64_t>;
  all.push_back(OfOwners("liquidblend_owner_stored_bytes", "What an owner has stored", now.owners,
                         [](const OwnerFigures& owner) -> Value { return owner.stored_bytes; }));
  all.push_back(OfOwners(
      "liquidblend_owner_max_stored_bytes", "What an owner may have stored", now.owners,
      [](const OwnerFigures& owner) { return UnlessZero(owner.limits.max_stored_bytes); }));
  all.push_back(OfOwners("liquidblend_owner_queued_jobs",
                         "Operations of an owner that are not done", now.owners,
                         [](const OwnerFigures& owner) -> Value { return owner.queued_jobs; }));
  all.push_back(
      OfOwners("liquidblend_owner_max_queued_jobs", "Operations that an owner may have", now.owners,
               [](const OwnerFigures& owner) { return UnlessZero(owner.limits.max_queued_jobs); }));
  if (now.max_stored_bytes == 0) return;
  all.push_back(OneGauge("liquidblend_max_stored_bytes", "What all owners together may have stored",
                         static_cast<double>(now.max_stored_bytes)));
}

void AddDisks(const Snapshot& now, std::vector<MetricFamily>& all) {
  std::map<std::string, int64_t> free, size, reserve;
  for (const auto& [folder, disk] : now.disks) {
    free[folder] = disk.free_bytes;
    size[folder] = disk.size_bytes;
    reserve[folder] = disk.reserve_bytes;
  }
  all.push_back(
      Gauges("liquidblend_disk_free_bytes", "Free space that the server may use", "disk", free));
  all.push_back(Gauges("liquidblend_disk_size_bytes", "Size of the store's disk", "disk", size));
  all.push_back(Gauges("liquidblend_disk_reserve_bytes",
                       "Free space that stays; with less, nothing more is accepted", "disk",
                       reserve));
}

void AddFrames(const Snapshot& now, std::vector<MetricFamily>& all) {
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
}

}  // namespace

void AddSnapshot(const Snapshot& now, std::vector<MetricFamily>& all) {
  all.push_back(Gauges("liquidblend_family_bytes",
                       "Memory of a loaded family, mapped file included", "family",
                       now.family_bytes));
  all.push_back(OneGauge("liquidblend_families_loaded", "Families that are loaded",
                         static_cast<double>(now.family_bytes.size())));
  if (now.catalog.has_value()) AddCatalog(*now.catalog, all);
  AddOwners(now, all);
  all.push_back(Gauges("liquidblend_store_reachable", "Whether the catalog or the blobs answer",
                       "store", {now.is_reachable.begin(), now.is_reachable.end()}));
  AddDisks(now, all);
  all.push_back(Gauges("liquidblend_waiting_calls", "Calls that wait for a thread of a pool",
                       "pool", now.waiting_calls));
  AddFrames(now, all);
  all.push_back(OneCounter("liquidblend_spans_exported_total", "Spans of traces that were exported",
                           static_cast<double>(now.spans.num_exported)));
  all.push_back(CountersOf("liquidblend_spans_dropped_total",
                           "Spans of traces that were not exported, by what left them out",
                           "reason", now.spans.dropped));
  if (!now.certificate_expiry.has_value()) return;
  all.push_back(OneGauge("liquidblend_tls_certificate_expiry_timestamp_seconds",
                         "When the first certificate of the server's chain expires, Unix time",
                         static_cast<double>(absl::ToUnixSeconds(*now.certificate_expiry))));
}

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

}  // namespace liquidblend::metrics
