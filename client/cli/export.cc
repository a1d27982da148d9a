// liquidblend export FAMILY --weights W[,W..] | --parameters NAME=VALUE[,..] -o DIR --format
// ply|obj|bobj
#include <filesystem>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/blend_flags.h"
#include "client/cli/commands.h"
#include "client/cli/encoding_flags.h"
#include "client/cli/files.h"
#include "client/cli/json.h"
#include "client/cli/mesh_file.h"
#include "client/cli/parse.h"
#include "client/cli/progress_bar.h"
#include "client/cli/surface_flags.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

constexpr int kExportBits = 20;  // the finest grid there is: 2 micrometres in a box of 2 metres

struct ExportFlags {
  std::string family;
  BlendFlags blend;
  std::string directory;
  std::string format = "ply";
  double frames_per_second = 0.0;  // 0: the family's
  EncodingFlags encoding = {.position_bits = kExportBits};
  SurfaceFlags surface;
};

struct ExportResult {
  int num_files = 0;
  int64_t version = 0;
  std::vector<double> weights;
  bool extrapolated = false;
  std::string first_file;
};

std::string FilePath(const ExportFlags& flags, int number) {
  const std::string name = flags.format == "bobj"
                               ? absl::StrFormat("fluid_mesh_%04d.bobj.gz", number)
                               : absl::StrFormat("frame_%04d.%s", number, flags.format);
  return (std::filesystem::path(flags.directory) / name).string();
}

StreamSettings ToSettings(const ExportFlags& flags, const Blend& blend) {
  StreamSettings settings;
  settings.family = flags.family;
  settings.weights = blend.weights;
  settings.parameters = blend.parameters;
  settings.extrapolate = blend.extrapolate;
  settings.time_s = 0.0;
  SetEncoding(flags.encoding, settings);
  settings.loop = false;
  settings.lossless = true;
  settings.surface = ToSurfaceOptions(flags.surface);
  if (flags.frames_per_second > 0.0) settings.frames_per_second = flags.frames_per_second;
  return settings;
}

// Reads the stream to its end, one file per frame.
absl::StatusOr<ExportResult> WriteFrames(FrameStream& stream, const ExportFlags& flags,
                                         double duration_s, ProgressBar& bar) {
  ExportResult result;
  for (;;) {
    LBC_ASSIGN_OR_RETURN(const std::optional<StreamedFrame> streamed, stream.Read());
    if (!streamed) return result;
    LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(streamed->frame.data));
    const std::string path = FilePath(flags, result.num_files + 1);
    LBC_RETURN_IF_ERROR(WriteMeshFile(mesh, path));
    if (result.num_files++ == 0) result.first_file = path;
    result.version = streamed->frame.version;
    result.weights = streamed->frame.weights;
    result.extrapolated = streamed->frame.extrapolated;
    const double time_s = streamed->frame.time_s;
    bar.Update(
        duration_s > 0.0 ? time_s / duration_s : 1.0, "export",
        absl::StrFormat("export, %.2f of %.2f s, %d files", time_s, duration_s, result.num_files));
  }
}

absl::Status RunExport(const ExportFlags& flags, const Context& context) {
  LBC_RETURN_IF_ERROR(CheckAttributes(flags.surface, flags.format));
  LBC_ASSIGN_OR_RETURN(const Blend blend, ToRequiredBlend(flags.blend));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Family family, client->GetFamily(flags.family));
  LBC_RETURN_IF_ERROR(MakeDirectory(flags.directory));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<FrameStream> stream,
                       client->StreamFrames(ToSettings(flags, blend)));
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  LBC_ASSIGN_OR_RETURN(const ExportResult result,
                       WriteFrames(*stream, flags, family.duration_s, bar));
  bar.Finish();
  if (result.num_files == 0) {
    return absl::InternalError(absl::StrCat(family.name, ": the server sent no frames"));
  }
  context.Print(absl::StrCat(result.num_files, " files, from ", result.first_file,
                             " on: ", family.name, " version ", result.version, ", weights ",
                             FormatNumbers(result.weights),
                             result.extrapolated ? " (extrapolated)" : ""));
  context.PrintJson(
      {{"directory", flags.directory},
       {"first_file", result.first_file},
       {"num_files", result.num_files},
       {"family", family.name},
       {"version", result.version},
       {"weights", result.weights},
       {"extrapolated", result.extrapolated},
       {"frames_per_second",
        flags.frames_per_second > 0.0 ? flags.frames_per_second : family.frames_per_second}});
  return absl::OkStatus();
}

}  // namespace

void AddExport(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<ExportFlags>();
  CLI::App* command =
      app.add_subcommand("export", "Write every frame of a blend to a directory, a file each");
  command->add_option("FAMILY", flags->family, "The family's id")->required();
  AddBlendFlags(*command, flags->blend);
  command->add_option("-o,--output", flags->directory, "DIR; made if needed")->required();
  command
      ->add_option("--format", flags->format,
                   "ply or obj: frame_0001.ply; bobj: fluid_mesh_0001.bobj.gz, as Mantaflow's "
                   "cache, but in metres (import it with --vertex-scale 1)")
      ->check(CLI::IsMember({"ply", "obj", "bobj"}))
      ->capture_default_str();
  command->add_option("--fps", flags->frames_per_second, "Frames per second; default the family's")
      ->check(CLI::PositiveNumber);
  AddEncodingFlags(*command, flags->encoding);
  AddSurfaceFlags(*command, flags->surface);
  command->callback([flags, &context] { context.status = RunExport(*flags, context); });
}

}  // namespace liquidblend::cli
