#include "server/probes/probes.h"

#include <atomic>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "core/base/disk_space.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/open_store.h"
#include "server/base/guarded.h"
#include "server/metrics/owner_figures.h"

namespace liquidblend::server {
namespace {

using metrics::CatalogFigures;

constexpr absl::Duration kLimit = absl::Seconds(2);  // of a caller's wait

// Of probes: those of orchestrators come every few seconds, and wait for one or a few.
SharedLookOptions StoresOptions() {
  return {.name = "the catalog or the object store", .kept = absl::Seconds(1), .limit = kLimit};
}

SharedLookOptions CatalogOptions() {
  return {.name = "the catalog", .kept = absl::Seconds(5), .limit = kLimit};
}

// The query reads the rows of all animations and families.
SharedLookOptions OwnersOptions() {
  return {.name = "the catalog", .kept = absl::Seconds(30), .limit = kLimit};
}

// Without what is missing, Prometheus shows a gap.
void LogMissing(const absl::Status& status) {
  if (status.ok()) return;
  base::LogWarning(absl::StrCat("metrics: cannot read the catalog: ", status.ToString()));
}

}  // namespace

// A text of metrics that waits for its looks.
struct Probes::PendingText {
  explicit PendingText(Done when_done) : done(std::move(when_done)) {}

  Done done;
  std::atomic<int> num_missing = 3;
  absl::StatusOr<Reachability> stores;
  absl::StatusOr<CatalogFigures> catalog;
  absl::StatusOr<Owners> owners;
};

template <typename Answer>
Probes::Look<Answer> Probes::MakeLook(absl::StatusOr<Answer> (Probes::*look)(),
                                      SharedLookOptions options) {
  return std::make_shared<SharedLook<Answer>>(
      backends_.probes, backends_.steps, [this, look] { return (this->*look)(); },
      std::move(options));
}

Probes::Probes(Backends& backends, const AccessController& access_controller)
    : backends_(backends),
      access_controller_(access_controller),
      job_counter_(backends.catalog, backends.metrics),
      stores_(MakeLook(&Probes::LookAtStores, StoresOptions())),
      catalog_(MakeLook(&Probes::LookAtCatalog, CatalogOptions())),
      owners_(MakeLook(&Probes::LookAtOwners, OwnersOptions())) {}

absl::StatusOr<Probes::Reachability> Probes::LookAtStores() {
  return Reachability{.catalog = store::CheckCatalog(backends_.catalog),
                      .blobs = store::CheckBlobs(backends_.blobs)};
}

absl::StatusOr<CatalogFigures> Probes::LookAtCatalog() {
  absl::StatusOr<CatalogFigures> figures = metrics::ReadCatalogFigures(backends_.catalog);
  const absl::Status status = figures.ok() ? job_counter_.Update() : figures.status();
  LogMissing(status);
  if (!status.ok()) return status;
  return figures;
}

absl::StatusOr<Probes::Owners> Probes::LookAtOwners() {
  absl::StatusOr<Owners> owners = backends_.catalog.ListOwners();
  LogMissing(owners.status());
  return owners;
}

void Probes::CheckStores(Done done) {
  stores_->Ask([done = std::move(done)](const absl::StatusOr<Reachability>& seen) mutable {
    if (!seen.ok()) return done(seen.status());
    absl::Status status = seen->catalog;
    status.Update(seen->blobs);
    if (!status.ok()) return done(FromServer(status));
    done("ok");
  });
}

void Probes::GetMetricsText(Done done) {
  const auto text = std::make_shared<PendingText>(std::move(done));
  const auto take = [this, text](auto PendingText::*answer) {
    return [this, text, answer](const auto& seen) {
      (*text).*answer = seen;
      if (--text->num_missing == 0) Finish(text);
    };
  };
  stores_->Ask(take(&PendingText::stores));
  catalog_->Ask(take(&PendingText::catalog));
  owners_->Ask(take(&PendingText::owners));
}

void Probes::Finish(const std::shared_ptr<PendingText>& text) {
  const absl::Status posted = backends_.probes.Post([this, text] {
    RunGuarded("an answer", [&] {
      text->done(Guarded([&]() -> absl::StatusOr<std::string> { return TextOf(*text); }));
    });
  });
  if (!posted.ok()) text->done(posted);
}

std::string Probes::TextOf(const PendingText& text) const {
  metrics::Snapshot snapshot;
  snapshot.family_bytes = backends_.families.SizesBytes();
  snapshot.waiting_calls = {{"io", backends_.io.num_waiting()},
                            {"transfers", backends_.transfers.num_waiting()},
                            {"loads", backends_.loads.num_waiting()}};
  const FrameCache::Stats cache = backends_.frame_cache.stats();
  snapshot.frame_cache = {cache.num_hits, cache.num_misses, cache.num_frames, cache.size_bytes};
  const FramePool::Stats queue = backends_.frames.stats();
  snapshot.frame_queue = {queue.waiting_cost, queue.num_refused};
  const trace::SpanStats spans = backends_.tracer->stats();
  snapshot.spans = {spans.num_exported,
                    {{"rate", spans.num_over_rate},
                     {"queue", spans.num_over_queue},
                     {"collector", spans.num_refused}}};
  snapshot.max_stored_bytes = backends_.limits.max_stored_bytes;
  if (text.catalog.ok()) snapshot.catalog = *text.catalog;
  if (text.owners.ok()) AddOwners(*text.owners, snapshot);
  AddStores(text, snapshot);
  AddDisk(snapshot);
  if (backends_.certificate_expiry) {
    const absl::StatusOr<absl::Time> expiry = backends_.certificate_expiry();
    if (expiry.ok()) snapshot.certificate_expiry = *expiry;
  }
  return backends_.metrics.Text(snapshot);
}

void Probes::AddStores(const PendingText& text, metrics::Snapshot& snapshot) const {
  if (text.stores.ok()) {
    snapshot.is_reachable = {{"catalog", text.stores->catalog.ok()},
                             {"blobs", text.stores->blobs.ok()}};
    return;
  }
  // One of them hangs. If the catalog has not answered here either, nothing is known of the blobs.
  snapshot.is_reachable["catalog"] = text.catalog.ok();
  if (text.catalog.ok()) snapshot.is_reachable["blobs"] = false;
}

void Probes::AddOwners(const Owners& owners, metrics::Snapshot& snapshot) const {
  std::map<std::string, metrics::OwnerLimits> limits;
  for (const Principal& principal : access_controller_.Principals()) {
    limits[principal.name] = {principal.limits.max_stored_bytes, principal.limits.max_queued_jobs};
  }
  snapshot.owners = metrics::JoinOwners(owners, limits);
}

void Probes::AddDisk(metrics::Snapshot& snapshot) const {
  const std::string& path = backends_.limits.disk;
  if (path.empty()) return;
  const absl::StatusOr<base::DiskSpace> disk = base::ReadDiskSpace(path);
  if (!disk.ok()) return;
  snapshot.disks[path] = {.free_bytes = disk->free_bytes,
                          .size_bytes = disk->size_bytes,
                          .reserve_bytes = backends_.limits.disk_reserve_bytes};
}

}  // namespace liquidblend::server
