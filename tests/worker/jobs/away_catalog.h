// A catalog that is away, or refuses calls, when the test says so.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "tests/core/store/catalog/forwarding_catalog.h"

namespace liquidblend::jobs {

// Calls of workers that change something ask `before` first, by their names; an error is their
// answer. Threads: safe if `before` is.
class AwayCatalog : public store::ForwardingCatalog {
 public:
  using ForwardingCatalog::ForwardingCatalog;

  absl::StatusOr<std::optional<store::Lease>> LeaseJob(const std::string& worker,
                                                       absl::Duration duration,
                                                       int64_t memory_bytes) override {
    if (absl::Status status = before("LeaseJob"); !status.ok()) return status;
    return ForwardingCatalog::LeaseJob(worker, duration, memory_bytes);
  }
  absl::StatusOr<store::JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                              const store::pb::JobProgress& progress) override {
    if (absl::Status status = before("Heartbeat"); !status.ok()) return status;
    return ForwardingCatalog::Heartbeat(lease_id, duration, progress);
  }
  absl::Status PublishAnimation(const std::string& lease_id,
                                const store::pb::AnimationRecord& animation) override {
    if (absl::Status status = before("PublishAnimation"); !status.ok()) return status;
    return ForwardingCatalog::PublishAnimation(lease_id, animation);
  }
  absl::Status FailJob(const std::string& lease_id, const absl::Status& error,
                       bool retry) override {
    if (absl::Status status = before("FailJob"); !status.ok()) return status;
    return ForwardingCatalog::FailJob(lease_id, error, retry);
  }

  absl::Status RecordWorker(const store::pb::WorkerRecord& worker) override {
    if (absl::Status status = before("RecordWorker"); !status.ok()) return status;
    return ForwardingCatalog::RecordWorker(worker);
  }

  std::function<absl::Status(const std::string& call)> before = [](const std::string&) {
    return absl::OkStatus();
  };
};

}  // namespace liquidblend::jobs
