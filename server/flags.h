// Flags of liquidblend-server, and the settings that follow from them.
#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/open_store.h"
#include "server/catalog/families.h"
#include "server/collector.h"
#include "server/grpc/server.h"
#include "server/http/port.h"
#include "server/worker_processes.h"

namespace liquidblend::server {

struct Flags {
  store::StoreLocation store;
  std::string listen = "127.0.0.1:50051";
  std::string http;  // empty: no HTTP port
  std::string http_origin;
  std::vector<std::string> http_hosts;
  int workers = 1;
  int threads = 0;            // 0: one per core
  int worker_threads = 0;     // 0: a share of the cores
  int cores_shared_by = 0;    // workers on this machine; 0: workers
  int64_t worker_memory = 0;  // 0: a share of base::MemoryForJobs()
  std::string worker_lease = "30s";
  std::string grace = "5s";
  std::string connection_age = "30s";  // 0: without limit
  std::string preload = "60s";         // 0: nothing is preloaded
  std::string collect_every = "1h";
  std::string collect_older_than = "24h";
  std::string keep_history = "30d";
  int keep_versions = server::Limits().keep_versions;
  int64_t max_message = int64_t{4} << 20;
  int64_t max_upload = int64_t{64} << 30;
  int64_t max_stored = 0;                   // 0: not limited
  int64_t disk_reserve = int64_t{1} << 30;  // 0: none
  int64_t memory = int64_t{8} << 30;
  int64_t frame_cache = int64_t{256} << 20;
  int64_t max_waiting_cells = server::FrameQueueOptions().max_waiting_cost;
  std::string log_format = "text";
  bool verbose = false;

  server::TlsOptions tls;
  bool insecure = false;
  std::string tokens;
  std::vector<std::string> import_roots;  // NAME=DIR

  bool check = false;      // check the running server instead of serving
  std::string make_token;  // the name of a new principal; no serving
  std::vector<std::string> scopes = {"frames"};
};

void AddFlags(CLI::App& app, Flags& flags);

// Settings from Flags, checked.
struct Settings {
  server::ServerOptions server;
  std::optional<http::PortOptions> http;  // nothing: no HTTP port
  WorkerProcessesOptions workers;
  liquidblend::catalog::FamiliesOptions families;
  absl::Duration grace;
  CollectorOptions collector;
};

// Errors: kInvalidArgument and others that name the flag.
absl::StatusOr<Settings> SettingsOf(const Flags& flags);

}  // namespace liquidblend::server
