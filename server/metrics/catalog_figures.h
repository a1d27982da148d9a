// Figures of the catalog: jobs and workers.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"

namespace liquidblend::metrics {

// The same in every server on the catalog.
struct CatalogFigures {
  std::map<std::string, int64_t> jobs;     // by state, e.g. "queued"
  std::map<std::string, int64_t> workers;  // "ready" and "refused"
  // By state ("queued" and "running"), the jobs that a worker with so much memory may take: "1GiB",
  // "2GiB"... "1024GiB", and "any".
  std::map<std::string, std::map<std::string, int64_t>> jobs_within_memory;
  store::QueueFigures queue;
};

// Reads the figures.  Threads: safe.  Errors: those of the catalog.
absl::StatusOr<CatalogFigures> ReadCatalogFigures(store::Catalog& catalog);

}  // namespace liquidblend::metrics
