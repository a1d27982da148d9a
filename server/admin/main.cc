// liquidblend-admin: maintenance of a store: check, garbage collection, export and import, the
// queue.
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/exit_status.h"
#include "core/base/log.h"
#include "core/base/nearest.h"
#include "core/base/status_macros.h"
#include "core/base/version.h"
#include "core/parallel/arena.h"
#include "core/store/blobs/mapped_file.h"
#include "core/store/data_directory.h"
#include "core/store/open_store.h"
#include "server/admin/check.h"
#include "server/admin/collect.h"
#include "server/admin/jobs.h"
#include "server/admin/plan.h"
#include "server/admin/print.h"
#include "server/admin/progress.h"
#include "server/admin/transfer.h"
#include "server/store_flags.h"

namespace liquidblend::admin {
namespace {

constexpr char kExitCodes[] =
    "Exit status: 0 done, and no damage found; 1 failed; 2 a flag or value that is refused; 3 the\n"
    "store cannot be reached; 7 something in the store or the export is damaged or missing.";

struct Flags {
  store::StoreLocation store;
  int threads = 0;  // 0: one per core
  bool json = false;
  bool repair = false;
  bool dry_run = false;
  bool adopt = false;
  std::string older_than = "24h";
  std::string keep_history = "30d";
  std::string place;  // of an export
  int num_failed = 20;
  Load load;  // to plan for
};

// Runs a subcommand; returns the exit code.
using Command = absl::StatusOr<int> (*)(const Flags&);

Format FormatOf(const Flags& flags) { return flags.json ? Format::kJson : Format::kText; }

// An archive on standard output leaves no room for the report.
void Show(const std::string& text, std::FILE* file = stdout) { std::fputs(text.c_str(), file); }

// A mistyped --data would make a new store, in which all is well.
absl::Status CheckIsThere(const store::StoreLocation& location) {
  LB_RETURN_IF_ERROR(location.Validate());
  struct stat info;
  const std::string path = store::CatalogPath(location.data);
  if (location.is_shared() || stat(path.c_str(), &info) == 0) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("--data: there is no ", path));
}

absl::StatusOr<store::Store> OpenExisting(const Flags& flags) {
  LB_RETURN_IF_ERROR(CheckIsThere(flags.store));
  return store::OpenStore(flags.store);
}

absl::StatusOr<int> RunCheck(const Flags& flags) {
  LB_RETURN_IF_ERROR(CheckIsThere(flags.store));
  const parallel::Arena arena(flags.threads);
  Progress progress(Progress::ChooseStyle());
  LB_ASSIGN_OR_RETURN(const CheckReport report,
                      Check(flags.store, arena, progress, {.repair = flags.repair}));
  Show(Print(report, FormatOf(flags)));
  return report.damage.empty() ? base::kExitDone : base::kExitDamaged;
}

absl::StatusOr<int> RunCollect(const Flags& flags) {
  CollectOptions options;
  options.dry_run = flags.dry_run;
  options.adopt = flags.adopt;
  LB_ASSIGN_OR_RETURN(options.older_than,
                      server::ParseDurationFlag("--older-than", flags.older_than));
  LB_ASSIGN_OR_RETURN(options.keep_history,
                      server::ParseDurationFlag("--keep-history", flags.keep_history));
  LB_ASSIGN_OR_RETURN(const store::Store store, OpenExisting(flags));
  LB_ASSIGN_OR_RETURN(const CollectReport report, Collect(*store.catalog, *store.blobs, options));
  Show(Print(report, flags.dry_run, FormatOf(flags)));
  return base::kExitDone;
}

absl::StatusOr<int> RunExport(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const store::Store store, OpenExisting(flags));
  const parallel::Arena arena(flags.threads);
  Progress progress(Progress::ChooseStyle());
  const bool is_stream = flags.place == "-";
  LB_ASSIGN_OR_RETURN(const TransferReport report,
                      is_stream ? ExportToStream(store, std::cout, progress)
                                : ExportToDirectory(store, flags.place, arena, progress));
  Show(Print(report, "exported", FormatOf(flags)), is_stream ? stderr : stdout);
  return base::kExitDone;
}

absl::StatusOr<int> RunImport(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const store::Store store, store::OpenStore(flags.store));
  const parallel::Arena arena(flags.threads);
  Progress progress(Progress::ChooseStyle());
  LB_ASSIGN_OR_RETURN(const TransferReport report,
                      flags.place == "-"
                          ? ImportFromStream(std::cin, store, progress)
                          : ImportFromDirectory(flags.place, store, arena, progress));
  Show(Print(report, "imported", FormatOf(flags)));
  return base::kExitDone;
}

absl::StatusOr<int> RunQueue(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const store::Store store, OpenExisting(flags));
  LB_ASSIGN_OR_RETURN(const QueueReport report, InspectQueue(*store.catalog, flags.num_failed));
  Show(Print(report, absl::Now(), FormatOf(flags)));
  return base::kExitDone;
}

absl::StatusOr<int> RunWorkers(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const store::Store store, OpenExisting(flags));
  LB_ASSIGN_OR_RETURN(const std::vector<Worker> workers, InspectWorkers(*store.catalog));
  Show(Print(workers, absl::Now(), FormatOf(flags)));
  return base::kExitDone;
}

absl::StatusOr<int> RunOwners(const Flags& flags) {
  LB_ASSIGN_OR_RETURN(const store::Store store, OpenExisting(flags));
  LB_ASSIGN_OR_RETURN(const std::vector<store::OwnerUse> owners, store.catalog->ListOwners());
  Show(Print(owners, FormatOf(flags)));
  return base::kExitDone;
}

absl::StatusOr<int> RunPlan(const Flags& flags) {
  LB_RETURN_IF_ERROR(flags.load.Validate());
  Show(Print(MakePlan(flags.load), FormatOf(flags)));
  return base::kExitDone;
}

// One with the flags that all of them have.
CLI::App& AddCommandWithoutStore(CLI::App& app, Flags& flags, const char* name, const char* help,
                                 Command command, Command& chosen) {
  CLI::App& made = *app.add_subcommand(name, help);
  made.add_flag("--json", flags.json, "Print one JSON object instead of text");
  made.footer(kExitCodes);
  made.callback([command, &chosen] { chosen = command; });
  return made;
}

CLI::App& AddCommand(CLI::App& app, Flags& flags, const char* name, const char* help,
                     Command command, Command& chosen) {
  CLI::App& made = AddCommandWithoutStore(app, flags, name, help, command, chosen);
  server::AddStoreFlags(made, flags.store);
  return made;
}

void AddThreads(CLI::App& command, Flags& flags) {
  command.add_option("--threads", flags.threads, "Blobs at a time; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
}

void AddPlan(CLI::App& app, Flags& flags, Command& chosen) {
  CLI::App& plan = AddCommandWithoutStore(
      app, flags, "plan",
      "Estimate what a load needs of machines, network and stores; needs no store", RunPlan,
      chosen);
  Load& load = flags.load;
  plan.add_option("--vertices", load.vertices, "Of a frame, on average")->capture_default_str();
  plan.add_option("--frames", load.frames, "Of an animation")->capture_default_str();
  plan.add_option("--targets", load.targets, "Of a family")->capture_default_str();
  plan.add_option("--families", load.families, "That are stored")->capture_default_str();
  plan.add_option("--families-in-use", load.families_in_use, "At a time; 0: all")
      ->capture_default_str();
  plan.add_option("--clients", load.clients, "That ask for frames at a time")
      ->capture_default_str();
  plan.add_option("--frames-per-second", load.frames_per_second, "Of each client")
      ->capture_default_str();
  plan.add_option("--cached", load.cached, "Share of frames that repeat, 0 to 1")
      ->capture_default_str();
  plan.add_option("--registrations-per-day", load.registrations_per_day, "Of a family each")
      ->capture_default_str();
  plan.add_option("--core-speed", load.core_speed,
                  "Of your cores, by those that docs/capacity.md was measured on")
      ->capture_default_str();
}

void AddCommands(CLI::App& app, Flags& flags, Command& chosen) {
  CLI::App& check =
      AddCommand(app, flags, "check",
                 "Read and verify everything; name what is damaged or missing, and who needs it",
                 RunCheck, chosen);
  check.add_flag("--repair", flags.repair,
                 "Put damaged blobs into quarantine, mark animations whose file is lost as "
                 "failed; loses nothing (docs/operations/stores.md)");
  AddThreads(check, flags);
  CLI::App& collect = AddCommand(
      app, flags, "collect", "Delete blobs that nothing refers to, and jobs that ended long ago",
      RunCollect, chosen);
  collect
      .add_option("--older-than", flags.older_than,
                  "Only those written longer ago; longer than any upload or import takes")
      ->capture_default_str();
  server::AddHistoryFlag(collect, flags.keep_history);
  collect.add_flag("--dry-run", flags.dry_run, "Only count them");
  collect.add_flag("--adopt", flags.adopt,
                   "The blobs belong to this catalog, even if they were another's, whose own are "
                   "deleted");
  CLI::App& exports =
      AddCommand(app, flags, "export",
                 "Write everything into a directory, or as a tar archive to standard output (-); "
                 "repeat it after an error, and it goes on",
                 RunExport, chosen);
  exports.add_option("place", flags.place, "DIR or -")->required();
  AddThreads(exports, flags);
  CLI::App& imports = AddCommand(app, flags, "import",
                                 "Add what was exported, from a directory or a tar archive (-); "
                                 "refused as a whole if a name is taken",
                                 RunImport, chosen);
  imports.add_option("place", flags.place, "DIR or -")->required();
  AddThreads(imports, flags);
  AddCommand(app, flags, "queue", "Show jobs: how many are in which state, which wait or failed",
             RunQueue, chosen)
      .add_option("--failed", flags.num_failed, "Show so many of the jobs that failed last")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  AddCommand(app, flags, "workers", "Show the workers, and who works on what since when",
             RunWorkers, chosen);
  AddCommand(app, flags, "owners", "Show what each owner has in the store and in the queue",
             RunOwners, chosen);
  AddPlan(app, flags, chosen);
}

// A word that stands where a command should be. Returns whether there is one.
bool ExplainUnknownCommand(const CLI::App& app) {
  const std::vector<std::string> left_over = app.remaining();
  if (!app.get_subcommands().empty() || left_over.empty() || left_over[0][0] == '-') return false;
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(command->get_name());
  }
  Show(base::UnknownCommandMessage("liquidblend-admin", left_over[0], commands), stderr);
  return true;
}

int Main(int argc, char** argv) {
  CLI::App app("Looks after a store of liquidblend, which may be in use");
  app.footer(kExitCodes);
  app.set_version_flag("--version",
                       base::VersionLine("liquidblend-admin", store::DescribeTables()));
  app.require_subcommand(1);
  Flags flags;
  Command command = nullptr;
  AddCommands(app, flags, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0 && ExplainUnknownCommand(app)) return base::kExitUsage;
    return app.exit(error) == 0 ? base::kExitDone : base::kExitUsage;
  }
  store::TakeFromEnvironment(flags.store);
  store::SurviveUnreadablePages();
  base::StartLog("liquidblend-admin", base::LogLevel::kInfo);
  const absl::StatusOr<int> code = command(flags);
  if (code.ok()) return *code;
  Show(absl::StrCat("liquidblend-admin: ", std::string(code.status().message()), "\n"), stderr);
  return base::ExitStatusOf(code.status());
}

}  // namespace
}  // namespace liquidblend::admin

int main(int argc, char** argv) { return liquidblend::admin::Main(argc, argv); }
