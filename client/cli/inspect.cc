// liquidblend inspect FILE|NAME
#include <memory>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/files/correspondences.h"
#include "client/cli/files/files.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "client/cli/flags/clean_text.h"
#include "client/cli/print/describe.h"
#include "client/cli/print/json.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

struct InspectFlags {
  std::string subject;
  std::string correspondences_json;
};

absl::Status OnlyOfAFamily(const InspectFlags& flags) {
  if (flags.correspondences_json.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("--correspondences-json: ", flags.subject, " is not a family"));
}

absl::Status InspectFile(const InspectFlags& flags, const Context& context) {
  const std::string& path = flags.subject;
  LBC_RETURN_IF_ERROR(OnlyOfAFamily(flags));
  LBC_ASSIGN_OR_RETURN(const Mesh mesh, ReadMeshFile(path));
  const MeshStats stats = ComputeMeshStats(mesh);
  Json json = {{"file", path}};
  json.update(ToJson(stats));
  context.PrintText(absl::StrCat(CleanLine(path), "\n", Describe(stats)));
  context.PrintJson(json);
  return absl::OkStatus();
}

template <typename Resource>
absl::Status Show(const absl::StatusOr<Resource>& resource, const Context& context) {
  LBC_RETURN_IF_ERROR(resource.status());
  context.PrintText(Describe(*resource));
  context.PrintJson(ToJson(*resource));
  return absl::OkStatus();
}

absl::Status ShowFamily(const absl::StatusOr<Family>& family, const InspectFlags& flags,
                        const Context& context) {
  LBC_RETURN_IF_ERROR(Show(family, context));
  if (flags.correspondences_json.empty()) return absl::OkStatus();
  return WriteFile(flags.correspondences_json, FormatCorrespondences(*family));
}

// An id without its collection may be a family or an animation: families first.
absl::Status InspectName(const InspectFlags& flags, const Context& context) {
  const std::string& name = flags.subject;
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  if (!absl::StartsWith(name, "animations/")) {
    const absl::StatusOr<Family> family = client->GetFamily(name);
    if (!absl::IsNotFound(family.status()) || absl::StartsWith(name, "families/")) {
      return ShowFamily(family, flags, context);
    }
  }
  const absl::StatusOr<Animation> animation = client->GetAnimation(name);
  if (absl::IsNotFound(animation.status()) && !absl::StartsWith(name, "animations/")) {
    return absl::NotFoundError(absl::StrCat(name, ": no family and no animation of this name"));
  }
  LBC_RETURN_IF_ERROR(animation.status());
  LBC_RETURN_IF_ERROR(OnlyOfAFamily(flags));
  return Show(animation, context);
}

}  // namespace

void AddInspect(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<InspectFlags>();
  CLI::App* command = app.add_subcommand(
      "inspect", "Describe a mesh file, or an animation or family on the server");
  command
      ->add_option("SUBJECT", flags->subject,
                   "FILE.{drc,ply,obj,bobj.gz}, or a name: ID, animations/ID, families/ID")
      ->required();
  command->add_option(
      "--correspondences-json", flags->correspondences_json,
      "Write the family's correspondences, automatic ones too, to this file: to be "
      "edited, and read by register --correspondences; none is written unless given");
  command->callback([flags, &context] {
    context.status = IsMeshFileName(flags->subject) ? InspectFile(*flags, context)
                                                    : InspectName(*flags, context);
  });
}

}  // namespace liquidblend::cli
