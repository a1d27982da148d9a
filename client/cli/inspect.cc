// liquidblend inspect FILE|NAME
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/describe.h"
#include "client/cli/json.h"
#include "client/cli/mesh_file.h"
#include "client/cli/mesh_stats.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

absl::Status InspectFile(const std::string& path, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const Mesh mesh, ReadMeshFile(path));
  const MeshStats stats = ComputeMeshStats(mesh);
  Json json = {{"file", path}};
  json.update(ToJson(stats));
  context.Print(absl::StrCat(path, "\n", Describe(stats)));
  context.PrintJson(json);
  return absl::OkStatus();
}

template <typename Resource>
absl::Status Show(const absl::StatusOr<Resource>& resource, const Context& context) {
  LBC_RETURN_IF_ERROR(resource.status());
  context.Print(Describe(*resource));
  context.PrintJson(ToJson(*resource));
  return absl::OkStatus();
}

// An id without its collection may be a family or an animation: families first.
absl::Status InspectName(const std::string& name, const Context& context) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  if (absl::StartsWith(name, "animations/")) return Show(client->GetAnimation(name), context);
  const absl::StatusOr<Family> family = client->GetFamily(name);
  if (!absl::IsNotFound(family.status()) || absl::StartsWith(name, "families/")) {
    return Show(family, context);
  }
  const absl::StatusOr<Animation> animation = client->GetAnimation(name);
  if (absl::IsNotFound(animation.status())) {
    return absl::NotFoundError(absl::StrCat(name, ": no family and no animation of this name"));
  }
  return Show(animation, context);
}

}  // namespace

void AddInspect(CLI::App& app, Context& context) {
  const auto subject = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "inspect", "Describe a mesh file, or an animation or family on the server");
  command
      ->add_option("SUBJECT", *subject,
                   "FILE.{drc,ply,obj,bobj.gz}, or a name: ID, animations/ID, families/ID")
      ->required();
  command->callback([subject, &context] {
    context.status =
        IsMeshFileName(*subject) ? InspectFile(*subject, context) : InspectName(*subject, context);
  });
}

}  // namespace liquidblend::cli
