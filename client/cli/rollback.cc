// liquidblend rollback FAMILY VERSION
#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/flags/number_checks.h"
#include "client/cli/print/describe.h"
#include "client/cli/print/json.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct RollbackFlags {
  std::string family;
  int64_t version = 0;
};

absl::Status RunRollback(const RollbackFlags& flags, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Family family, client->RollbackFamily(flags.family, flags.version));
  context.PrintText(Describe(family));
  context.PrintJson(ToJson(family));
  return absl::OkStatus();
}

}  // namespace

void AddRollback(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<RollbackFlags>();
  CLI::App* command = app.add_subcommand(
      "rollback", "Publish a kept version of a family again, as its newest version");
  command->add_option("FAMILY", flags->family, "The family")->required();
  command
      ->add_option("VERSION", flags->version, "A version that `liquidblend inspect` lists as kept")
      ->required()
      ->check(Positive());
  command->callback([flags, &context] { context.status = RunRollback(*flags, context); });
}

}  // namespace liquidblend::cli
