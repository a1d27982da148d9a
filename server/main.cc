// liquidblend-server: answers clients, and runs the workers of a single machine.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/exit_status.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/base/version.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/open_store.h"
#include "core/trace/tracer.h"
#include "server/access/token_file.h"
#include "server/catalog/families.h"
#include "server/collector.h"
#include "server/data_lock.h"
#include "server/flags.h"
#include "server/grpc/check_serving.h"
#include "server/grpc/server.h"
#include "server/http/port.h"
#include "server/worker_processes.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kTokensInterval = absl::Seconds(1);  // between two looks at the file
constexpr absl::Duration kHttpGrace = absl::Seconds(1);       // for answers that are on their way
constexpr absl::Duration kCheckTimeout = absl::Seconds(5);
constexpr char kPortFile[] = "server.port";
constexpr char kHttpPortFile[] = "http.port";

// Null without --http.
absl::StatusOr<std::unique_ptr<http::Port>> StartHttp(const Settings& settings, server::Api& api) {
  if (!settings.http.has_value()) return nullptr;
  return http::Port::Start(api, *settings.http);
}

// For scripts: whole or not there.
absl::Status WritePortFile(const std::string& data, const char* name, int port) {
  const std::string path = absl::StrCat(data, "/", name);
  const std::string temporary = absl::StrCat(path, ".new");
  std::ofstream(temporary) << port << "\n";
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (!error) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("cannot write '", path, "': ", error.message()));
}

void RemovePortFiles(const std::string& data) {
  for (const char* name : {kPortFile, kHttpPortFile}) {
    std::error_code error;
    std::filesystem::remove(absl::StrCat(data, "/", name), error);
  }
}

void Announce(const std::string& what, const std::string& address) {
  std::printf("%s %s\n", what.c_str(), address.c_str());
  std::fflush(stdout);
  base::LogInfo(absl::StrCat(what, " ", address));
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

void ReloadTokens(server::Authorizer& authorizer) {
  const absl::Status status = authorizer.ReloadIfChanged();
  if (status.ok()) return;
  base::LogError(absl::StrCat("keeping the previous token file: ", status.ToString()));
}

// Tends workers and tokens until someone asks to stop.
void TendUntilStopped(const Settings& settings, WorkerProcesses& workers) {
  const absl::Duration pause =
      settings.server.authorizer == nullptr ? absl::InfiniteDuration() : kTokensInterval;
  while (true) {
    const absl::Duration until_workers = workers.Tend();
    if (settings.server.authorizer != nullptr) ReloadTokens(*settings.server.authorizer);
    const int signal = WaitForSignal(std::min(until_workers, pause));
    if (signal == SIGTERM || signal == SIGINT) return;
  }
}

// Standard output gets a whole file for --tokens, standard error one for the client's --token-file:
// the token alone on its first line.
absl::Status PrintNewToken(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const server::NewToken made,
                      server::MakeToken(flags.make_token, flags.scopes));
  std::printf("{\"principals\": [\n  %s\n]}\n", made.entry.c_str());
  std::fprintf(stderr, "%s\nThis is the token of '%s': kept nowhere, for its owner only.\n",
               made.token.c_str(), flags.make_token.c_str());
  return absl::OkStatus();
}

std::string ProgramVersion() {
  return base::VersionLine("liquidblend-server", store::DescribeTables());
}

absl::Status Run(const Flags& flags) {
  if (!flags.make_token.empty()) return PrintNewToken(flags);
  if (flags.check) return server::CheckServing(flags.listen, flags.tls, kCheckTimeout);
  LB_ASSIGN_OR_RETURN(Settings settings, SettingsOf(flags));
  base::LogInfo(ProgramVersion());
  std::optional<DataLock> lock;  // servers share what is in --store
  if (!flags.store.is_shared()) {
    LB_RETURN_IF_ERROR(flags.store.Validate());
    LB_ASSIGN_OR_RETURN(DataLock taken, DataLock::Take(flags.store.data));
    lock.emplace(std::move(taken));
  }
  store::SurviveUnreadablePages();
  LB_ASSIGN_OR_RETURN(const store::Store store, store::OpenStore(flags.store));
  catalog::Families families(*store.catalog, *store.blobs, settings.families);
  WorkerProcesses workers(settings.workers);
  const std::shared_ptr<trace::Tracer> tracer =
      trace::Tracer::Open({"liquidblend-server", base::Version()}, base::LogWarning);
  settings.server.tracer = tracer;
  LB_ASSIGN_OR_RETURN(const auto server, server::Server::Start(*store.catalog, *store.blobs,
                                                               families, settings.server));
  LB_ASSIGN_OR_RETURN(const auto http_port, StartHttp(settings, server->api()));
  if (lock.has_value()) {
    LB_RETURN_IF_ERROR(WritePortFile(flags.store.data, kPortFile, server->port()));
  }
  if (lock.has_value() && http_port != nullptr) {
    LB_RETURN_IF_ERROR(WritePortFile(flags.store.data, kHttpPortFile, http_port->port()));
  }
  base::LogInfo(absl::StrCat("data in ", store.name));
  Announce("listening on", server->address());
  if (http_port != nullptr) Announce("http on", http_port->address());

  {
    const Collector collector(*store.catalog, *store.blobs, server->api().metrics(),
                              settings.collector);
    TendUntilStopped(settings, workers);
  }

  base::LogInfo("stopping");
  if (lock.has_value()) RemovePortFiles(flags.store.data);
  workers.AskToStop();
  if (http_port != nullptr) http_port->Drain();
  server->Drain(settings.grace);
  if (http_port != nullptr) http_port->Stop(kHttpGrace);
  tracer->Stop();
  workers.Stop(settings.grace);
  return absl::OkStatus();
}

}  // namespace
}  // namespace liquidblend::server

int main(int argc, char** argv) {
  using liquidblend::base::LogLevel;
  CLI::App app("Blends registered liquid simulations, over gRPC");
  liquidblend::server::Flags flags;
  liquidblend::server::AddFlags(app, flags);
  app.set_version_flag("--version", liquidblend::server::ProgramVersion());
  app.footer(liquidblend::base::kExitStatusHelp);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? liquidblend::base::kExitDone : liquidblend::base::kExitUsage;
  }
  liquidblend::store::TakeFromEnvironment(flags.store);
  // Debian's Abseil looks for cycles at every lock that is taken, gRPC's included; tests do that.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  // Before any thread exists, so that only WaitForSignal() hears of them.
  const sigset_t signals = liquidblend::server::WatchedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  liquidblend::base::StartLog("liquidblend-server",
                              flags.verbose ? LogLevel::kDebug : LogLevel::kInfo,
                              *liquidblend::base::ParseLogFormat(flags.log_format));
  const absl::Status status = liquidblend::server::Run(flags);
  if (status.ok()) return liquidblend::base::kExitDone;
  liquidblend::base::LogError(status.ToString());
  return flags.check ? liquidblend::base::ExitStatusOfCheck(status)
                     : liquidblend::base::ExitStatusOf(status);
}
