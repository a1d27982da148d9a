// liquidblend operations [OPERATION [--wait]] and liquidblend cancel OPERATION
#include <memory>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/print/describe.h"
#include "client/cli/print/json.h"
#include "client/cli/print/wait.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct OperationsFlags {
  std::string name;
  bool wait = false;
};

absl::Status ShowAll(Client& client, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::vector<Operation> operations, client.ListOperations());
  Json json = Json::array();
  for (const Operation& operation : operations) {
    context.Print(Summarize(operation));
    json.push_back(ToJson(operation));
  }
  context.PrintJson(json);
  return absl::OkStatus();
}

absl::Status RunOperations(const OperationsFlags& flags, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  if (flags.name.empty()) return ShowAll(*client, context);
  absl::StatusOr<Operation> operation = flags.wait ? WatchWithProgress(*client, flags.name, context)
                                                   : client->GetOperation(flags.name);
  LBC_RETURN_IF_ERROR(operation.status());
  context.Print(Summarize(*operation));
  context.PrintJson(ToJson(*operation));
  if (!flags.wait) return absl::OkStatus();
  LBC_RETURN_IF_ERROR(FailureOf(*operation));
  return CheckVerdict(*operation);
}

absl::Status RunCancel(const std::string& name, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_RETURN_IF_ERROR(client->CancelOperation(name));
  LBC_ASSIGN_OR_RETURN(const Operation operation, client->GetOperation(name));
  context.Print(operation.done ? Summarize(operation)
                               : absl::StrCat(operation.name, " is being cancelled"));
  context.PrintJson(ToJson(operation));
  return absl::OkStatus();
}

}  // namespace

void AddOperations(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<OperationsFlags>();
  CLI::App* command =
      app.add_subcommand("operations", "List imports and registrations, or show one");
  CLI::Option* name = command->add_option("OPERATION", flags->name, "Only this one");
  command->add_flag("--wait", flags->wait, "Show progress until it is done")->needs(name);
  command->callback([flags, &context] { context.status = RunOperations(*flags, context); });
}

void AddCancel(CLI::App& app, Context& context) {
  const auto name = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("cancel", "Cancel an import or a registration");
  command->add_option("OPERATION", *name, "Its name")->required();
  command->callback([name, &context] { context.status = RunCancel(*name, context); });
}

}  // namespace liquidblend::cli
