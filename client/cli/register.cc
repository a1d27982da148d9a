// liquidblend register FAMILY --source NAME --target NAME [--target NAME ...]
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/correspondences.h"
#include "client/cli/describe.h"
#include "client/cli/json.h"
#include "client/cli/wait.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct RegisterFlags {
  RegisterRequest request;
  std::string correspondences;
  bool wait = false;
};

absl::Status RunRegister(const RegisterFlags& flags, const Context& context) {
  RegisterRequest request = flags.request;
  if (!flags.correspondences.empty()) {
    LBC_ASSIGN_OR_RETURN(request.correspondences, ReadCorrespondences(flags.correspondences));
  }
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Operation started, client->RegisterFamily(request));
  if (!flags.wait) {
    context.Print(started.name);
    context.PrintJson(ToJson(started));
    context.Remark(HowToWatch(started.name));
    return absl::OkStatus();
  }
  LBC_ASSIGN_OR_RETURN(const Operation finished, WaitWithProgress(*client, started.name, context));
  Family family;
  if (finished.family) {
    family = *finished.family;
  } else {
    LBC_ASSIGN_OR_RETURN(family, client->GetFamily(request.family));
  }
  context.Print(Describe(family));
  context.PrintJson(ToJson(family));
  return absl::OkStatus();
}

}  // namespace

void AddRegister(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<RegisterFlags>();
  RegisterRequest& request = flags->request;
  RegistrationOptions& options = request.options;
  CLI::App* command =
      app.add_subcommand("register", "Register animations to one another: makes a family");
  command->add_option("FAMILY", request.family, "Id of the family")->required();
  command->add_option("--source", request.source, "The animation that is deformed")->required();
  command->add_option("--target", request.targets, "What it is blended with; repeat for more")
      ->required();
  command->add_flag("--wait", flags->wait, "Show progress until it is done");
  command->add_option("--iterations", options.max_iterations, "Iterations per target")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--node-spacing", options.node_spacing_edges,
                   "Distance of deformation nodes in mean edge lengths")
      ->check(CLI::PositiveNumber);
  command->add_option("--sample-share", options.sample_share, "Share of vertices per iteration")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--smoothness", options.final_smoothness, "Smoothness at the last iteration")
      ->check(CLI::PositiveNumber);
  command->add_option("--seed", options.seed, "Seed of the random samples");
  command->add_option(
      "--correspondences", flags->correspondences,
      "JSON file: {\"correspondences\": [[{\"kind\": \"point\" | \"trajectory\" | \"space\", "
      "\"hard\": false, \"source\": {\"position\": [x, y, z], \"time_s\": t}, \"target\": {...}, "
      "\"length_s\": s}]]}, one list per target");
  command->callback([flags, &context] { context.status = RunRegister(*flags, context); });
}

}  // namespace liquidblend::cli
