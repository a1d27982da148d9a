// The server's program on a data directory, for load tests.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
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

// A process of its own, without workers; its log goes to standard error.
// Errors: kUnavailable if it does not start, or does not tell what is asked.  Threads: safe.
class LoadServer {
 public:
  static absl::StatusOr<std::unique_ptr<LoadServer>> Start(const LoadServerOptions& options);

  pid_t pid() const { return process_.pid(); }
  int http_port() const { return http_port_; }

  // Of frames of this family.  Errors: kNotFound if there is none.
  absl::StatusOr<LoadTarget> Target(const std::string& family) const;
  absl::StatusOr<StageSums> ReadStageSums() const;
  absl::StatusOr<MemoryFigures> ReadMemory() const;

 private:
  LoadServer(e2e::Process process, std::string address, int http_port)
      : process_(std::move(process)), address_(std::move(address)), http_port_(http_port) {}
  absl::StatusOr<std::string> ReadMetrics() const;

  e2e::Process process_;
  const std::string address_;
  const int http_port_;
};

}  // namespace liquidblend::bench
