// Values that are read when metrics are requested, instead of being counted.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "server/metrics/catalog_figures.h"
#include "server/metrics/owner_figures.h"

namespace liquidblend::metrics {

struct Snapshot {
  struct Cache {
    int64_t num_hits = 0;
    int64_t num_misses = 0;
    int64_t num_frames = 0;  // held now
    int64_t num_bytes = 0;
  };
  struct Queue {
    int64_t waiting_cells = 0;
    int64_t num_refused = 0;
  };
  // A file system that the store uses.
  struct Disk {
    int64_t free_bytes = 0;
    int64_t size_bytes = 0;
    int64_t reserve_bytes = 0;  // that stay free
  };
  // Spans of traces.
  struct Spans {
    int64_t num_exported = 0;
    std::map<std::string, int64_t> dropped;  // by reason
  };
  std::optional<CatalogFigures> catalog;         // nothing: not known
  std::vector<OwnerFigures> owners;              // none: not known
  int64_t max_stored_bytes = 0;                  // of all owners together; 0: not limited
  std::map<std::string, bool> is_reachable;      // "catalog", "blobs"
  std::map<std::string, int64_t> family_bytes;   // loaded now, by id
  std::map<std::string, int64_t> waiting_calls;  // by the pool that they wait for
  std::map<std::string, Disk> disks;             // by the folder on it
  Cache frame_cache;
  Queue frame_queue;  // of frames that wait to be made
  Spans spans;
  std::optional<absl::Time> certificate_expiry;  // nothing: no TLS
};

}  // namespace liquidblend::metrics
