// liquidblend frame FAMILY --weights W[,W..] | --parameters NAME=VALUE[,..] --time SECONDS -o FILE
#include <memory>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/files/files.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/flags/blend_flags.h"
#include "client/cli/flags/encoding_flags.h"
#include "client/cli/flags/parse.h"
#include "client/cli/flags/surface_flags.h"
#include "client/cli/flags/version_flag.h"
#include "client/cli/print/json.h"
#include "client/cli/print/progress_bar.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

struct FrameFlags {
  FrameRequest request;
  BlendFlags blend;
  std::string output;
  EncodingFlags encoding;
  SurfaceFlags surface;
};

absl::Status WriteFrame(const Frame& frame, const std::string& path) {
  if (Extension(path) == "drc") return WriteFile(path, frame.data);
  LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(frame.data));
  return WriteMeshFile(mesh, path);
}

absl::Status RunFrame(const FrameFlags& flags, const Context& context) {
  if (!IsWrittenMeshFileName(flags.output) && Extension(flags.output) != "drc") {
    return absl::InvalidArgumentError(
        absl::StrCat("-o ", flags.output, ": must end in .drc, ", kWrittenMeshFiles));
  }
  LBC_RETURN_IF_ERROR(CheckOutput(flags.output));
  LBC_RETURN_IF_ERROR(CheckAttributes(flags.surface, Extension(flags.output)));
  FrameRequest request = flags.request;
  SetEncoding(flags.encoding, request);
  request.surface = ToSurfaceOptions(flags.surface);
  LBC_ASSIGN_OR_RETURN(const Blend blend, ToRequiredBlend(flags.blend));
  request.weights = blend.weights;
  request.parameters = blend.parameters;
  request.extrapolate = blend.extrapolate;
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  // Now the client knows the newest version, and asks for at least that one.
  if (request.version == 0) LBC_RETURN_IF_ERROR(client->GetFamily(request.family).status());
  LBC_ASSIGN_OR_RETURN(const Frame frame, client->GetFrame(request));
  LBC_RETURN_IF_ERROR(WriteFrame(frame, flags.output));
  context.Print(absl::StrCat(flags.output, ": ", frame.family, " version ", frame.version,
                             ", weights ",
                             DescribeWeights(frame.weights, frame.extrapolated, frame.clamped),
                             ", time ", frame.time_s, " s: ", frame.num_triangles, " triangles, ",
                             FormatBytes(static_cast<int64_t>(frame.data.size())), " of Draco"));
  context.PrintJson({{"file", flags.output},
                     {"family", frame.family},
                     {"version", frame.version},
                     {"weights", frame.weights},
                     {"extrapolated", frame.extrapolated},
                     {"clamped", frame.clamped},
                     {"time_s", frame.time_s},
                     {"num_vertices", frame.num_vertices},
                     {"num_triangles", frame.num_triangles},
                     {"num_draco_bytes", frame.data.size()},
                     {"bounds", ToJson(frame.bounds)}});
  return absl::OkStatus();
}

}  // namespace

void AddFrame(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<FrameFlags>();
  CLI::App* command = app.add_subcommand("frame", "Write one frame of a blend to a mesh file");
  command->add_option("FAMILY", flags->request.family, "The family's id")->required();
  AddBlendFlags(*command, flags->blend);
  command->add_option("--time,-t", flags->request.time_s, "Seconds since the first frame")
      ->required();
  command->add_option("-o,--output", flags->output, "FILE.{drc,ply,obj,bobj.gz,stl}")->required();
  AddEncodingFlags(*command, flags->encoding);
  AddVersionFlag(flags->request.version, *command);
  AddSurfaceFlags(*command, flags->surface);
  command->callback([flags, &context] { context.status = RunFrame(*flags, context); });
}

}  // namespace liquidblend::cli
