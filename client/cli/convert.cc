// liquidblend convert IN.{drc,ply,obj,bobj.gz} OUT.{ply,obj,bobj.gz,stl}
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands.h"
#include "client/cli/files/files.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/print/json.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

struct ConvertFlags {
  std::string input;
  std::string output;
};

// Attributes of the mesh that have no place in the file.
std::string LeftOut(const Mesh& mesh, const std::string& extension) {
  std::vector<std::string> left_out;
  if (!mesh.normals.empty() && (extension == "obj" || extension == "stl"))
    left_out.push_back("normals");
  if (!mesh.velocities.empty() && extension != "ply") left_out.push_back("velocities");
  if (!mesh.rest.empty() && extension != "ply") left_out.push_back("rest positions");
  return absl::StrJoin(left_out, " and ");
}

absl::Status RunConvert(const ConvertFlags& flags, const Context& context) {
  const std::string extension = Extension(flags.output);
  if (!IsWrittenMeshFileName(flags.output)) {
    return absl::InvalidArgumentError(
        absl::StrCat(flags.output, ": must end in ", kWrittenMeshFiles));
  }
  LBC_RETURN_IF_ERROR(CheckOutput(flags.output));
  std::string passed_over;
  LBC_ASSIGN_OR_RETURN(const Mesh mesh, ReadMeshFile(flags.input, &passed_over));
  LBC_RETURN_IF_ERROR(WriteMeshFile(mesh, flags.output));
  if (!passed_over.empty()) {
    context.Remark(absl::StrCat(flags.output, ": without ", passed_over, " of ", flags.input,
                                ", which are not read"));
  }
  const std::string left_out = LeftOut(mesh, extension);
  if (!left_out.empty()) {
    context.Remark(absl::StrCat(flags.output, ": without ", left_out, ", which .", extension,
                                " has no place for; .ply has"));
  }
  context.Print(absl::StrCat(flags.output, ": ", mesh.num_vertices(), " vertices, ",
                             mesh.num_triangles(), " triangles"));
  context.PrintJson({{"file", flags.output},
                     {"num_vertices", mesh.num_vertices()},
                     {"num_triangles", mesh.num_triangles()}});
  return absl::OkStatus();
}

}  // namespace

void AddConvert(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<ConvertFlags>();
  CLI::App* command =
      app.add_subcommand("convert", "Write a mesh file in another format; needs no server");
  command->add_option("IN", flags->input, "FILE.{drc,ply,obj,bobj.gz}")->required();
  command->add_option("OUT", flags->output, "FILE.{ply,obj,bobj.gz,stl}; positions in metres")
      ->required();
  command->callback([flags, &context] { context.status = RunConvert(*flags, context); });
}

}  // namespace liquidblend::cli
