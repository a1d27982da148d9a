// Answers to probes and to Prometheus: whether the stores can be reached, and the metrics.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "server/access/access_controller.h"
#include "server/base/shared_look.h"
#include "server/frames/backends.h"
#include "server/metrics/catalog_figures.h"
#include "server/metrics/job_counter.h"
#include "server/metrics/snapshot.h"

namespace liquidblend::server {

// Concurrent callers share each look at a store. Looks use no thread that other calls need.
// Threads: safe.
class Probes {
 public:
  using Done = absl::AnyInvocable<void(absl::StatusOr<std::string>)>;

  // Both outlive it, and the backends have stopped before it ends.
  Probes(Backends& backends, const AccessController& access_controller);
  Probes(const Probes&) = delete;
  Probes& operator=(const Probes&) = delete;

  // "ok" if both stores answer.
  void CheckStores(Done done);
  // See Api::GetMetricsText().
  void GetMetricsText(Done done);

 private:
  // Whether each store answers.
  struct Reachability {
    absl::Status catalog;
    absl::Status blobs;
  };
  using Owners = std::vector<store::OwnerUse>;
  struct PendingText;
  template <typename Answer>
  using Look = std::shared_ptr<SharedLook<Answer>>;

  template <typename Answer>
  Look<Answer> MakeLook(absl::StatusOr<Answer> (Probes::*look)(), SharedLookOptions options);
  absl::StatusOr<Reachability> LookAtStores();
  absl::StatusOr<metrics::CatalogFigures> LookAtCatalog();
  absl::StatusOr<Owners> LookAtOwners();
  void Finish(const std::shared_ptr<PendingText>& text);
  std::string TextOf(const PendingText& text) const;
  void AddStores(const PendingText& text, metrics::Snapshot& snapshot) const;
  void AddOwners(const Owners& owners, metrics::Snapshot& snapshot) const;
  void AddDisk(metrics::Snapshot& snapshot) const;

  Backends& backends_;
  const AccessController& access_controller_;
  metrics::JobCounter job_counter_;
  const Look<Reachability> stores_;
  const Look<metrics::CatalogFigures> catalog_;
  const Look<Owners> owners_;
};

}  // namespace liquidblend::server
