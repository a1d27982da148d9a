// A catalog that counts how often it is asked for what many clients may ask for at once.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "tests/core/store/catalog/forwarding_catalog.h"

namespace liquidblend::server {

// Another one, which outlives it.
class CountingCatalog : public store::ForwardingCatalog {
 public:
  using ForwardingCatalog::ForwardingCatalog;

  int num_jobs_read() const { return num_jobs_read_; }
  int num_lists_of_workers() const { return num_lists_of_workers_; }

  absl::StatusOr<store::pb::JobRecord> GetJob(const std::string& id) override {
    ++num_jobs_read_;
    return ForwardingCatalog::GetJob(id);
  }
  absl::StatusOr<std::vector<store::pb::WorkerRecord>> ListWorkers() override {
    ++num_lists_of_workers_;
    return ForwardingCatalog::ListWorkers();
  }

 private:
  std::atomic<int> num_jobs_read_ = 0;
  std::atomic<int> num_lists_of_workers_ = 0;
};

}  // namespace liquidblend::server
