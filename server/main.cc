// liquidblend-server: answers clients, and runs the workers of a single machine.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/store/blob_store.h"
#include "core/store/catalog.h"
#include "core/store/data_directory.h"
#include "server/catalog/families.h"
#include "server/data_lock.h"
#include "server/rpc/server.h"
#include "server/sweep_blobs.h"
#include "server/worker_processes.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kFirstSweep = absl::Minutes(1);  // after the start
constexpr absl::Duration kSweepInterval = absl::Minutes(10);

struct Flags {
  std::string data;
  std::string listen = "127.0.0.1:50051";
  int workers = 1;
  int threads = 0;         // 0: one per core
  int worker_threads = 0;  // 0: one per core
  std::string worker_lease = "30s";
  std::string grace = "5s";
  std::string keep_unreferenced = "24h";
  int64_t max_message = int64_t{4} << 20;
  int64_t max_upload = int64_t{64} << 30;
  int64_t memory = int64_t{8} << 30;
  bool verbose = false;
};

void AddFlags(CLI::App& app, Flags& flags) {
  app.add_option("--data", flags.data, "Directory of everything that is kept; created if missing")
      ->required();
  app.add_option("--listen", flags.listen, "HOST:PORT; port 0: any free one")
      ->capture_default_str();
  app.add_option("--workers", flags.workers, "Worker processes to run on this machine")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Threads that compute frames; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--worker-threads", flags.worker_threads, "Threads of a worker; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--worker-lease", flags.worker_lease,
                 "How long a job waits for a worker that says nothing more")
      ->capture_default_str();
  app.add_option("--grace", flags.grace, "How long calls and workers may take to end on SIGTERM")
      ->capture_default_str();
  app.add_option("--keep-unreferenced", flags.keep_unreferenced,
                 "How long files that nothing refers to are kept")
      ->capture_default_str();
  app.add_option("--max-message", flags.max_message, "Largest request, e.g. 4MiB")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--max-upload", flags.max_upload, "Largest upload of one animation, e.g. 64GiB")
      ->transform(CLI::AsSizeValue(false));
  app.add_option("--memory", flags.memory, "Memory for loaded families, e.g. 8GiB")
      ->transform(CLI::AsSizeValue(false));
  app.add_flag("--verbose", flags.verbose, "Log details");
}

absl::StatusOr<absl::Duration> ParseFlag(const char* name, const std::string& text) {
  absl::Duration duration;
  if (absl::ParseDuration(text, &duration) && duration >= absl::ZeroDuration()) return duration;
  return absl::InvalidArgumentError(
      absl::StrCat(name, " must be a duration such as 30s or 500ms, got '", text, "'"));
}

absl::StatusOr<rpc::ServerOptions> ServerOptionsOf(const Flags& flags) {
  rpc::ServerOptions options;
  options.listen = flags.listen;
  const unsigned num_cores = std::max(1U, std::thread::hardware_concurrency());
  options.num_frame_threads = flags.threads > 0 ? flags.threads : static_cast<int>(num_cores);
  if (flags.max_message > std::numeric_limits<int>::max()) {
    return absl::InvalidArgumentError("--max-message must be below 2 GiB");
  }
  options.max_message_bytes = static_cast<int>(flags.max_message);
  options.limits.max_upload_bytes = flags.max_upload;
  LB_RETURN_IF_ERROR(options.Validate());
  return options;
}

absl::StatusOr<WorkerProcessesOptions> WorkerOptionsOf(const Flags& flags) {
  WorkerProcessesOptions options;
  options.binary = WorkerBinaryBesideThis();
  options.count = flags.workers;
  options.arguments = {"--data",    flags.data,
                       "--threads", absl::StrCat(flags.worker_threads),
                       "--lease",   flags.worker_lease};
  if (flags.verbose) options.arguments.push_back("--verbose");
  if (flags.workers > 0 && access(options.binary.c_str(), X_OK) != 0) {
    return absl::NotFoundError(absl::StrCat("there is no '", options.binary, "' to run"));
  }
  return options;
}

// For scripts: whole or not there.
absl::Status WritePortFile(const std::string& data, int port) {
  const std::string path = absl::StrCat(data, "/server.port");
  const std::string temporary = absl::StrCat(path, ".new");
  std::ofstream(temporary) << port << "\n";
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot write '", path, "': ", error.message()));
}

void RemovePortFile(const std::string& data) {
  std::error_code error;
  std::filesystem::remove(absl::StrCat(data, "/server.port"), error);
}

void Sweep(store::Catalog& catalog, store::BlobStore& blobs, absl::Duration keep) {
  const absl::StatusOr<SweepReport> report = SweepBlobs(catalog, blobs, absl::Now(), keep);
  if (!report.ok()) return base::LogWarning(absl::StrCat("sweep: ", report.status().ToString()));
  if (report->num_deleted == 0) return;
  base::LogInfo(absl::StrCat("sweep: deleted ", report->num_deleted, " files that nothing needs, ",
                             report->num_bytes, " bytes"));
}

sigset_t WatchedSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT, SIGCHLD}) sigaddset(&signals, number);
  return signals;
}

// Returns the signal, or -1 when the time is over.
int WaitForSignal(absl::Duration duration) {
  const sigset_t signals = WatchedSignals();
  const timespec timeout = absl::ToTimespec(std::max(duration, absl::ZeroDuration()));
  return sigtimedwait(&signals, nullptr, &timeout);
}

// Tends workers and disk until someone asks to stop.
void TendUntilStopped(WorkerProcesses& workers, store::Catalog& catalog, store::BlobStore& blobs,
                      absl::Duration keep) {
  absl::Time next_sweep = absl::Now() + kFirstSweep;
  while (true) {
    const absl::Duration until_workers = workers.Tend();
    if (absl::Now() >= next_sweep) {
      Sweep(catalog, blobs, keep);
      next_sweep = absl::Now() + kSweepInterval;
    }
    const int signal = WaitForSignal(std::min(until_workers, next_sweep - absl::Now()));
    if (signal == SIGTERM || signal == SIGINT) return;
  }
}

absl::Status Run(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const rpc::ServerOptions options, ServerOptionsOf(flags));
  LB_ASSIGN_OR_RETURN(const WorkerProcessesOptions worker_options, WorkerOptionsOf(flags));
  LB_ASSIGN_OR_RETURN(const absl::Duration grace, ParseFlag("--grace", flags.grace));
  LB_ASSIGN_OR_RETURN(const absl::Duration keep,
                      ParseFlag("--keep-unreferenced", flags.keep_unreferenced));
  LB_RETURN_IF_ERROR(ParseFlag("--worker-lease", flags.worker_lease).status());
  catalog::FamiliesOptions families_options;
  families_options.memory_budget_bytes = flags.memory;
  LB_RETURN_IF_ERROR(families_options.Validate());

  LB_ASSIGN_OR_RETURN(const DataLock lock, DataLock::Take(flags.data));
  LB_ASSIGN_OR_RETURN(const auto store_catalog,
                      store::OpenSqliteCatalog(store::CatalogPath(flags.data)));
  LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(flags.data));
  catalog::Families families(*store_catalog, *blobs, families_options);
  WorkerProcesses workers(worker_options);
  LB_ASSIGN_OR_RETURN(const auto server,
                      rpc::Server::Start(*store_catalog, *blobs, families, options));
  LB_RETURN_IF_ERROR(WritePortFile(flags.data, server->port()));
  std::printf("listening on %s\n", server->address().c_str());
  std::fflush(stdout);
  base::LogInfo(absl::StrCat("listening on ", server->address(), ", data in ", flags.data));

  TendUntilStopped(workers, *store_catalog, *blobs, keep);

  base::LogInfo("stopping");
  RemovePortFile(flags.data);
  workers.AskToStop();
  server->Drain(grace);
  workers.Stop(grace);
  return absl::OkStatus();
}

}  // namespace
}  // namespace liquidblend::server

int main(int argc, char** argv) {
  using liquidblend::base::LogLevel;
  CLI::App app("Blends registered liquid simulations, over gRPC");
  liquidblend::server::Flags flags;
  liquidblend::server::AddFlags(app, flags);
  CLI11_PARSE(app, argc, argv);
  // Before any thread exists, so that only WaitForSignal() hears of them.
  const sigset_t signals = liquidblend::server::WatchedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  liquidblend::base::StartLog("liquidblend-server",
                              flags.verbose ? LogLevel::kDebug : LogLevel::kInfo);
  const absl::Status status = liquidblend::server::Run(flags);
  if (status.ok()) return 0;
  liquidblend::base::LogError(status.ToString());
  return 1;
}
