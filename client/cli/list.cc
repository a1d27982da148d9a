// liquidblend list
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/print/describe.h"
#include "client/cli/print/json.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

absl::Status RunList(const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const std::vector<Animation> animations, client->ListAnimations());
  LBC_ASSIGN_OR_RETURN(const std::vector<Family> families, client->ListFamilies());
  Json json = {{"animations", Json::array()}, {"families", Json::array()}};
  for (const Animation& animation : animations) {
    context.Print(Summarize(animation));
    json["animations"].push_back(ToJson(animation));
  }
  for (const Family& family : families) {
    context.Print(Summarize(family));
    json["families"].push_back(ToJson(family));
  }
  context.PrintJson(json);
  if (animations.empty() && families.empty()) {
    context.Remark("Nothing yet. `liquidblend import NAME DIR` uploads an animation.");
  }
  return absl::OkStatus();
}

}  // namespace

void AddList(CLI::App& app, Context& context) {
  CLI::App* command = app.add_subcommand("list", "List animations and families");
  command->callback([&context] { context.status = RunList(context); });
}

}  // namespace liquidblend::cli
