#include "server/flags.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/cores.h"
#include "core/base/memory_limit.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog.h"
#include "server/store_flags.h"

namespace liquidblend::server {
namespace {

constexpr absl::Duration kShortestLease = absl::Milliseconds(100);  // as of the worker's

void AddSecurityFlags(CLI::App& app, Flags& flags) {
  const std::string group = "Security (docs/operations/tls-and-tokens.md)";
  app.add_option("--tls-cert", flags.tls.certificate,
                 "PEM file of the server's certificate chain; no TLS unless given")
      ->group(group);
  app.add_option("--tls-key", flags.tls.key, "PEM file of its key; no TLS unless given")
      ->group(group);
  app.add_option(
         "--tls-client-ca", flags.tls.client_ca,
         "PEM file of authorities; clients must show a certificate of theirs; none is asked for "
         "unless given")
      ->group(group);
  app.add_flag("--insecure", flags.insecure,
               "Without TLS, listen where other machines can reach, too")
      ->group(group);
  app.add_option(
         "--tokens", flags.tokens,
         "JSON file of who may do what; reloaded when it changes; everyone everything unless "
         "given")
      ->group(group);
  app.add_option("--import-root", flags.import_roots,
                 "NAME=DIR: clients may import animations from below DIR as NAME/...; repeatable; "
                 "none unless given")
      ->group(group);
  app.add_option(
         "--make-token", flags.make_token,
         "Print a file for --tokens with a principal of this name, and on standard error its "
         "new token, as liquidblend --token-file reads it; exit; no token is made unless given")
      ->group(group);
  app.add_option("--scopes", flags.scopes, "Of --make-token: some of frames,write,register")
      ->delimiter(',')
      ->capture_default_str()
      ->group(group);
}

// A worker would refuse another one, and end at once.
absl::Status CheckLease(const std::string& text) {
  LB_ASSIGN_OR_RETURN(const absl::Duration lease, ParseDurationFlag("--worker-lease", text));
  if (lease >= kShortestLease && lease <= store::kLongestLease) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--worker-lease must be from ", absl::FormatDuration(kShortestLease), " to ",
                   absl::FormatDuration(store::kLongestLease), ", got '", text, "'"));
}

// Of each of the server's workers; 0 if that is not known.
int64_t WorkerMemory(const Flags& flags) {
  return flags.worker_memory != 0 ? flags.worker_memory
                                  : base::MemoryForJobs() / std::max(1, flags.workers);
}

absl::StatusOr<server::ServerOptions> ServerOptionsOf(const Flags& flags) {
  server::ServerOptions options;
  options.listen = flags.listen;
  options.num_frame_threads = flags.threads > 0 ? flags.threads : base::NumCores();
  if (flags.max_message > std::numeric_limits<int>::max()) {
    return absl::InvalidArgumentError("--max-message must be below 2 GiB");
  }
  options.max_message_bytes = static_cast<int>(flags.max_message);
  options.limits.max_upload_bytes = flags.max_upload;
  options.limits.keep_versions = flags.keep_versions;
  options.limits.max_stored_bytes = flags.max_stored;
  options.limits.disk = flags.store.is_shared() ? flags.store.cache : flags.store.data;
  options.limits.disk_reserve_bytes = flags.disk_reserve;
  // Of a store that is shared, workers elsewhere may hold more.
  const bool knows_workers = flags.workers > 0 && !flags.store.is_shared();
  options.limits.worker_memory_bytes = knows_workers ? WorkerMemory(flags) : 0;
  options.frame_cache_bytes = flags.frame_cache;
  options.queue.max_waiting_cost = flags.max_waiting_cells;
  options.tls = flags.tls;
  options.allow_insecure = flags.insecure;
  LB_ASSIGN_OR_RETURN(options.connection_age,
                      ParseDurationFlag("--connection-age", flags.connection_age));
  LB_ASSIGN_OR_RETURN(options.preload_time, ParseDurationFlag("--preload", flags.preload));
  LB_ASSIGN_OR_RETURN(options.import_roots, server::ParseImportRoots(flags.import_roots));
  LB_RETURN_IF_ERROR(options.Validate());
  if (!flags.tokens.empty()) {
    LB_ASSIGN_OR_RETURN(options.authorizer, server::Authorizer::Open(flags.tokens));
  }
  return options;
}

absl::StatusOr<http::PortOptions> HttpOptionsOf(const Flags& flags) {
  http::PortOptions options;
  options.listen = flags.http;
  options.router.allowed_origin = flags.http_origin;
  options.router.hosts = flags.http_hosts;
  options.router.max_body_bytes = flags.max_message;
  options.router.max_bodies_bytes =
      std::max<int64_t>(options.router.max_bodies_bytes, flags.max_message);
  options.router.page = http::EmbeddedPage();
  LB_RETURN_IF_ERROR(options.Validate());
  if (!flags.insecure && !server::IsLoopback(flags.http)) {
    return absl::InvalidArgumentError(
        absl::StrCat("other machines can reach --http ", flags.http,
                     ", which has no TLS: listen on 127.0.0.1, behind what ends TLS, or say "
                     "--insecure if the network itself protects it"));
  }
  return options;
}

// The url of the catalog goes by the environment: everyone on this machine sees arguments.
void AddStoreArguments(const store::StoreLocation& store, std::vector<std::string>& arguments) {
  if (!store.is_shared()) {
    arguments.insert(arguments.end(), {"--data", store.data});
    return;
  }
  setenv("LIQUIDBLEND_STORE", store.catalog_url.c_str(), 1);
  arguments.insert(arguments.end(), {"--blobs", store.blobs_url, "--cache", store.cache,
                                     "--cache-size", absl::StrCat(store.cache_bytes)});
}

// Threads of each of the server's workers; with others on this machine as many as there are cores.
int WorkerThreads(const Flags& flags) {
  if (flags.worker_threads > 0) return flags.worker_threads;
  return base::ShareOfCores(base::NumCores(), std::max(flags.workers, flags.cores_shared_by));
}

absl::StatusOr<WorkerProcessesOptions> WorkerOptionsOf(const Flags& flags) {
  WorkerProcessesOptions options;
  options.binary = WorkerBinaryBesideThis();
  options.count = flags.workers;
  options.arguments = {"--threads",    absl::StrCat(WorkerThreads(flags)),
                       "--memory",     absl::StrCat(WorkerMemory(flags)),
                       "--lease",      flags.worker_lease,
                       "--log-format", flags.log_format};
  AddStoreArguments(flags.store, options.arguments);
  if (flags.verbose) options.arguments.push_back("--verbose");
  if (flags.workers > 0 && access(options.binary.c_str(), X_OK) != 0) {
    return absl::NotFoundError(absl::StrCat("there is no '", options.binary, "' to run"));
  }
  return options;
}

}  // namespace

void AddFlags(CLI::App& app, Flags& flags) {
  AddStoreFlags(app, flags.store);
  app.add_option(
         "--client-s3", flags.store.client_endpoint,
         "With --store: the endpoint of S3 as clients reach it, http(s)://host[:port]; then "
         "they send and get files there themselves, by urls that are good for 15 minutes; "
         "otherwise by the server")
      ->envname("LIQUIDBLEND_CLIENT_S3");
  app.add_option("--listen", flags.listen, "HOST:PORT; port 0: any free one")
      ->capture_default_str();
  app.add_option(
         "--http", flags.http,
         "HOST:PORT for browsers and probes (docs/operations/http.md); port 0: any free one; "
         "no such port unless given")
      ->envname("LIQUIDBLEND_HTTP");
  app.add_option("--http-origin", flags.http_origin,
                 "Whose pages may use the HTTP port, e.g. https://example.org; *: all; "
                 "only the port's own unless given");
  app.add_option("--http-host", flags.http_hosts,
                 "Name by which clients ask for the HTTP port, beside IP addresses, localhost and "
                 "the name in --http; repeatable; *: any; none unless given")
      ->envname("LIQUIDBLEND_HTTP_HOST")
      ->delimiter(',');
  app.add_option("--workers", flags.workers, "Worker processes to run on this machine")
      ->envname("LIQUIDBLEND_WORKERS")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  app.add_option("--threads", flags.threads, "Threads that compute frames; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--worker-threads", flags.worker_threads,
                 "Threads of a worker; 0: the cores divided by --workers or --cores-shared-by")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--cores-shared-by", flags.cores_shared_by,
                 "Workers on this machine in all, if others run beside --workers; 0: none do")
      ->envname("LIQUIDBLEND_CORES_SHARED_BY")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--worker-memory", flags.worker_memory,
                 "What a job of a worker may need, e.g. 8GiB; larger ones are refused, or with "
                 "--store left to others; 0: four fifths of the machine's or container's memory, "
                 "divided by --workers")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.worker_memory));
  app.add_option("--worker-lease", flags.worker_lease,
                 "How long a job waits for a worker without a heartbeat")
      ->capture_default_str();
  app.add_option("--grace", flags.grace, "How long calls and workers may take to end on SIGTERM")
      ->capture_default_str();
  app.add_option(
         "--connection-age", flags.connection_age,
         "When a client's gRPC connection is renewed, so that calls reach new servers, too; "
         "streams stay; 0: never")
      ->capture_default_str();
  app.add_option("--preload", flags.preload,
                 "How long a server that starts may load the families that are asked for most, "
                 "before it is ready; 0: none are loaded")
      ->capture_default_str();
  app.add_option("--collect-every", flags.collect_every,
                 "How often files that nothing refers to are looked for; 0: never")
      ->capture_default_str();
  app.add_option("--collect-older-than", flags.collect_older_than,
                 "How long they are kept; longer than any upload takes")
      ->capture_default_str();
  AddHistoryFlag(app, flags.keep_history);
  app.add_option("--keep-versions", flags.keep_versions,
                 "Versions of a family that are kept, the published one counted")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--max-message", flags.max_message, "Largest request, e.g. 4MiB")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.max_message));
  app.add_option("--max-upload", flags.max_upload, "Largest upload of one animation, e.g. 64GiB")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.max_upload));
  app.add_option("--max-stored", flags.max_stored,
                 "What all owners together may have stored, e.g. 2TiB; then uploads, imports and "
                 "registrations are refused; 0: not limited")
      ->envname("LIQUIDBLEND_MAX_STORED")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.max_stored));
  app.add_option("--disk-reserve", flags.disk_reserve,
                 "What stays free on the disk of --data or --cache; with less, uploads, imports "
                 "and registrations are refused; 0: none")
      ->envname("LIQUIDBLEND_DISK_RESERVE")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.disk_reserve));
  app.add_option("--memory", flags.memory, "Memory for loaded families, e.g. 8GiB")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.memory));
  app.add_option("--frame-cache", flags.frame_cache, "Memory for encoded frames, e.g. 256MiB")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(flags.frame_cache));
  app.add_option("--max-waiting-cells", flags.max_waiting_cells,
                 "Frames that wait to be made, as cells to be sliced; more are refused")
      ->capture_default_str();
  app.add_option("--log-format", flags.log_format, "text, or json: an object a line")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_flag("--verbose", flags.verbose, "Log details");
  app.add_flag("--check", flags.check,
               "Exit 0 if the server that runs with this --listen and --tls-* serves, 2 for a flag "
               "that is refused, else 1");
  AddSecurityFlags(app, flags);
}

absl::StatusOr<Settings> SettingsOf(const Flags& flags) {
  Settings settings;
  LB_ASSIGN_OR_RETURN(settings.server, ServerOptionsOf(flags));
  if (!flags.http.empty()) {
    LB_ASSIGN_OR_RETURN(settings.http, HttpOptionsOf(flags));
  }
  LB_ASSIGN_OR_RETURN(settings.workers, WorkerOptionsOf(flags));
  LB_ASSIGN_OR_RETURN(settings.grace, ParseDurationFlag("--grace", flags.grace));
  LB_ASSIGN_OR_RETURN(settings.collector.every,
                      ParseDurationFlag("--collect-every", flags.collect_every));
  LB_ASSIGN_OR_RETURN(settings.collector.older_than,
                      ParseDurationFlag("--collect-older-than", flags.collect_older_than));
  LB_ASSIGN_OR_RETURN(settings.collector.keep_history,
                      ParseDurationFlag("--keep-history", flags.keep_history));
  LB_RETURN_IF_ERROR(CheckLease(flags.worker_lease));
  settings.families.memory_budget_bytes = flags.memory;
  LB_RETURN_IF_ERROR(settings.families.Validate());
  return settings;
}

}  // namespace liquidblend::server
