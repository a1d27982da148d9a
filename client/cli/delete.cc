// liquidblend delete NAME
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/print/json.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

// Adds the collection to an id that has none.
absl::StatusOr<std::string> FullName(Client& client, const std::string& name) {
  if (absl::StrContains(name, '/')) return name;
  const absl::Status family = client.GetFamily(name).status();
  const absl::Status animation = client.GetAnimation(name).status();
  for (const absl::Status& status : {family, animation}) {
    if (!status.ok() && !absl::IsNotFound(status)) return status;
  }
  if (family.ok() && animation.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(name, " is a family and an animation: say ",
                                                   "families/", name, " or animations/", name));
  }
  if (!family.ok() && !animation.ok()) {
    return absl::NotFoundError(absl::StrCat(name, ": no family and no animation of this name"));
  }
  return absl::StrCat(family.ok() ? "families/" : "animations/", name);
}

absl::Status RunDelete(const std::string& id_or_name, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const std::string name, FullName(*client, id_or_name));
  if (absl::StartsWith(name, "families/")) {
    LBC_RETURN_IF_ERROR(client->DeleteFamily(name));
  } else if (absl::StartsWith(name, "animations/")) {
    LBC_RETURN_IF_ERROR(client->DeleteAnimation(name));
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": only families/ID and animations/ID are deleted"));
  }
  context.Print(absl::StrCat("deleted ", name));
  context.PrintJson({{"deleted", name}});
  return absl::OkStatus();
}

}  // namespace

void AddDelete(CLI::App& app, Context& context) {
  const auto name = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("delete", "Delete a family or an animation");
  command->add_option("NAME", *name, "ID, families/ID or animations/ID")->required();
  command->callback([name, &context] { context.status = RunDelete(*name, context); });
}

}  // namespace liquidblend::cli
