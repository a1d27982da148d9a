// liquidblend download NAME -o FILE
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/files/files.h"
#include "client/cli/flags/version_flag.h"
#include "client/cli/print/json.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct DownloadFlags {
  std::string name;
  std::string output;
  int64_t version = 0;  // 0: the published one
};

absl::Status RunDownload(const DownloadFlags& flags, const Context& context) {
  if (!absl::StartsWith(flags.name, "families/") && !absl::StartsWith(flags.name, "animations/")) {
    return absl::InvalidArgumentError(
        absl::StrCat(flags.name, ": say families/ID or animations/ID"));
  }
  LBC_RETURN_IF_ERROR(CheckOutput(flags.output));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const int64_t num_bytes,
                       client->Download(flags.name, flags.output, flags.version));
  context.Print(absl::StrCat(flags.output, ": ", num_bytes, " bytes"));
  context.PrintJson({{"name", flags.name}, {"path", flags.output}, {"bytes", num_bytes}});
  return absl::OkStatus();
}

}  // namespace

void AddDownload(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<DownloadFlags>();
  CLI::App* command = app.add_subcommand(
      "download",
      "Get the stored file of a family, which plays without a server, or of an animation");
  command->add_option("NAME", flags->name, "families/ID or animations/ID")->required();
  command->add_option("-o,--output", flags->output, "File to write")->required();
  AddVersionFlag(flags->version, *command);
  command->callback([flags, &context] { context.status = RunDownload(*flags, context); });
}

}  // namespace liquidblend::cli
