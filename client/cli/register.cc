// liquidblend register FAMILY --source NAME --target NAME [--target NAME ...]
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/files/correspondences.h"
#include "client/cli/flags/named_value.h"
#include "client/cli/flags/number_checks.h"
#include "client/cli/flags/points.h"
#include "client/cli/flags/priority_flag.h"
#include "client/cli/flags/registration_flags.h"
#include "client/cli/print/describe.h"
#include "client/cli/print/json.h"
#include "client/cli/print/wait.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct RegisterFlags {
  RegisterRequest request;
  std::vector<std::string> points;
  Interpolation interpolation = Interpolation::kUnspecified;
  std::string correspondences;
  bool wait = false;
};

absl::Status RunRegister(const RegisterFlags& flags, const Context& context) {
  RegisterRequest request = flags.request;
  if (!request.refine && (request.source.empty() || request.targets.empty())) {
    return absl::InvalidArgumentError("--source and --target are required without --refine");
  }
  if (!flags.correspondences.empty()) {
    LBC_ASSIGN_OR_RETURN(request.correspondences, ReadCorrespondences(flags.correspondences));
  }
  LBC_ASSIGN_OR_RETURN(request.parameter_space, ParsePoints(flags.points, request));
  request.parameter_space.interpolation = flags.interpolation;
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
  context.PrintText(Describe(family));
  context.PrintJson(ToJson(family));
  return CheckVerdict(finished);
}

void AddTimeBlendingFlags(TimeBlending& blending, CLI::App& command) {
  AddNamedValue<TimeBlending::Kind>(
      "--time-blending", blending.kind,
      "How times of matching events blend: as positions do (linear), or their squares,\n"
      "which is right for falls from rest, from different heights; auto, unless given:\n"
      "the worker decides; with --refine, as the family has it",
      {{"auto", TimeBlending::Kind::kAutomatic},
       {"linear", TimeBlending::Kind::kLinear},
       {"squares", TimeBlending::Kind::kSquares}},
      command);
  command.add_option("--rest-time", blending.rest_time_s,
                     "Squares of the times since then, seconds since the first frame (0); "
                     "not positive");
}

void AddSpaceTimeFlags(SpaceTimeOptions& options, CLI::App& command) {
  AddNamedValue<Connectivity>(
      "--connectivity", options.connectivity,
      "Whether frames share it (tracked) or not (rebuilt); auto, unless given: the server sees",
      {{"auto", Connectivity::kAuto},
       {"tracked", Connectivity::kTracked},
       {"rebuilt", Connectivity::kRebuilt}},
      command);
  command
      .add_option("--spacing", options.spacing_edges,
                  "Spacing of the space-time grid in mean edge lengths (0.9)")
      ->check(Positive());
  command
      .add_option("--droplet-vertices", options.droplet_vertices,
                  "Smaller components are carried as rigid pieces (150); 0: none are")
      ->check(NonNegative());
  command
      .add_option("--sheet-thickness", options.sheet_thickness_edges,
                  "Sheets up to this are thin, in mean edge lengths (1.5); 0: none are")
      ->check(NonNegative());
  command
      .add_option("--levels", options.coarser_levels,
                  "Levels of detail beside the finest (2), each half of the one before")
      ->check(NonNegative());
  AddOnOff("--keep-thin-sheets", options.keep_thin_sheets,
           "Sheets thinner than the grid's spacing stay whole instead of tearing (on), at\n"
           "the cost of some time and of a few small flakes inside out",
           command);
}

}  // namespace

void AddRegister(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<RegisterFlags>();
  RegisterRequest& request = flags->request;
  CLI::App* command =
      app.add_subcommand("register", "Register animations to one another: makes a family");
  command->add_option("FAMILY", request.family, "Id of the family")->required();
  command->add_option("--source", request.source,
                      "The animation that is deformed; of --refine otherwise the family's");
  command->add_option(
      "--target", request.targets,
      "What it is blended with; repeat for more; of --refine otherwise the family's");
  command->add_option("--at", flags->points,
                      "ANIMATION:NAME=VALUE[,..]: its point in the space of your own parameters, "
                      "e.g. drops-a:height=1.2,width=0.5; for the source and every target; no "
                      "parameters unless given");
  AddNamedValue<Interpolation>(
      "--interpolation", flags->interpolation,
      "How points between those of --at become weights: linearly in the simplex around\n"
      "them (linear, unless given), or by a smooth function through all animations,\n"
      "which are three or more; with --refine, as the family has it",
      {{"linear", Interpolation::kLinear}, {"smooth", Interpolation::kSmooth}}, *command);
  command->add_flag("--refine", request.refine,
                    "Go on from the family's newest version, with the correspondences given "
                    "instead of its own; --source and --target may be left out");
  command->add_flag("--replace", request.replace,
                    "Publish a new version, from scratch, of a family that exists already; "
                    "without this or --refine a name that is taken is refused");
  AddNamedValue<Grade>(
      "--require", request.required_grade,
      "The worst verdict that is published; with a worse one the operation fails and "
      "the version before stays. Any, unless given",
      {{"good", Grade::kGood}, {"doubtful", Grade::kDoubtful}}, *command);
  AddPriority(request.priority, *command);
  command->add_flag("--wait", flags->wait, "Show progress until it is done");
  AddTimeBlendingFlags(request.time_blending, *command);
  AddRegistrationFlags(request.options, *command);
  AddSpaceTimeFlags(request.space_time, *command);
  command->add_option(
      "--correspondences", flags->correspondences,
      "JSON file: {\"correspondences\": [[{\"kind\": \"point\" | \"trajectory\" | \"space\", "
      "\"hard\": false, \"source\": {\"position\": [x, y, z], \"time_s\": t}, \"target\": {...}, "
      "\"length_s\": s}]]}, one list per target; none unless given");
  command->callback([flags, &context] { context.status = RunRegister(*flags, context); });
}

}  // namespace liquidblend::cli
