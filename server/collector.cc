#include "server/collector.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "server/admin/collect.h"

namespace liquidblend::server {

Collector::Collector(store::Catalog& catalog, store::BlobStore& blobs, metrics::Metrics& metrics,
                     const CollectorOptions& options)
    : catalog_(catalog), blobs_(blobs), metrics_(metrics), options_(options) {
  if (options_.every > absl::ZeroDuration()) thread_ = std::thread([this] { Run(); });
}

Collector::~Collector() {
  stop_.Notify();
  if (thread_.joinable()) thread_.join();
}

void Collector::Run() {
  absl::Duration pause = std::min(options_.first_after, options_.every);
  while (!stop_.WaitForNotificationWithTimeout(pause)) {
    CollectOnce();
    pause = options_.every;
  }
}

void Collector::CollectOnce() {
  admin::CollectOptions options;
  options.older_than = options_.older_than;
  options.keep_history = options_.keep_history;
  options.must_stop = [this] { return stop_.HasBeenNotified(); };
  const absl::StatusOr<admin::CollectReport> report = admin::Collect(catalog_, blobs_, options);
  if (!report.ok()) {
    metrics_.CountCollection({.is_ok = false});
    return base::LogWarning(absl::StrCat("collect: ", report.status().ToString()));
  }
  metrics_.CountCollection(
      {.is_ok = true, .num_blobs = report->num_deleted, .num_bytes = report->deleted_bytes});
  if (report->num_pruned > 0) {
    base::Log(base::LogLevel::kInfo, "deleted old jobs of the history",
              {{"jobs", absl::StrCat(report->num_pruned)}});
  }
  if (report->num_uploads > 0) {
    base::Log(base::LogLevel::kInfo, "aborted abandoned multipart uploads",
              {{"uploads", absl::StrCat(report->num_uploads)}});
  }
  if (report->num_deleted == 0) return;
  base::Log(base::LogLevel::kInfo, "deleted unreferenced blobs",
            {{"blobs", absl::StrCat(report->num_deleted)},
             {"bytes", absl::StrCat(report->deleted_bytes)}});
}

}  // namespace liquidblend::server
