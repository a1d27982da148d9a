// The server's program on a data directory, for load tests.
#pragma once

#include <string>

#include "tests/bench/load_clients.h"
#include "tests/e2e/process.h"

namespace liquidblend::bench {

// Seconds since the server's start, by stage, and the frames that were made.
struct StageSums {
  double queue_s = 0.0;
  double slice_s = 0.0;
  double encode_s = 0.0;
  double num_frames = 0.0;
};

struct MemoryFigures {
  double resident_mb = 0.0;
  double heap_used_mb = 0.0;  // allocated and not freed
};

struct LoadServerOptions {
  std::string data;  // directory
  int num_threads = 2;
  double frame_cache_mb = 256.0;
};

// A process of its own, without workers; its log goes to standard error. Aborts with a message if
// it does not start.
class LoadServer {
 public:
  explicit LoadServer(const LoadServerOptions& options);

  // Of frames of this family.  Aborts if there is none.
  LoadTarget Target(const std::string& family) const;
  StageSums stage_sums() const;
  MemoryFigures memory() const;

 private:
  e2e::Process process_;
  std::string address_;
  int http_port_ = 0;
};

}  // namespace liquidblend::bench
