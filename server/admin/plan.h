// Plan of an installation: what a load needs of machines, network and stores (docs/capacity.md).
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace liquidblend::admin {

// What users will ask for.
struct Load {
  double vertices = 50'000;           // of a frame, on average; > 0
  int64_t frames = 150;               // of an animation; > 0
  int64_t targets = 1;                // of a family; 1 to 16
  int64_t families = 10;              // stored; >= 0
  int64_t families_in_use = 0;        // at a time; 0: all
  int64_t clients = 10;               // that ask for frames at a time; >= 0
  double frames_per_second = 24;      // of each client; >= 0
  double cached = 0;                  // share of the frames that the server has in its cache; 0..1
  double registrations_per_day = 10;  // of a family each; >= 0
  double core_speed = 1;              // of the cores, by those of docs/results.md; > 0
  absl::Status Validate() const;      // names the first field out of range, and its value
};

// Averages over time, and sizes. Servers and workers together, unless it says otherwise.
struct Plan {
  // Servers.
  double frame_ms = 0;              // of one core, to make and send a frame that is not cached
  double server_busy_cores = 0;     // that compute on average
  int64_t server_cores = 0;         // to have: busy for kBusyShare of the time
  int64_t server_memory_bytes = 0;  // of each server
  int64_t cache_disk_bytes = 0;     // of each server: files of the families in use
  double network_bytes_per_s = 0;   // to clients
  // Workers.
  double registration_core_s = 0;  // of one family
  double worker_busy_cores = 0;
  int64_t worker_cores = 0;
  int64_t worker_memory_bytes = 0;  // of a worker (liquidblend-worker --memory)
  // Stores.
  int64_t animation_bytes = 0;  // of one file
  int64_t family_bytes = 0;     // of one file
  int64_t bucket_bytes = 0;
  int64_t database_bytes = 0;
};

inline constexpr double kBusyShare = 0.6;  // of cores; more makes queues, and slow frames

// Requires: load.Validate().ok().
Plan MakePlan(const Load& load);

}  // namespace liquidblend::admin
