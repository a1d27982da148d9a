// liquidblend export FAMILY --weights W[,W..] | --parameters NAME=VALUE[,..] -o DIR --format
// ply|obj|stl|bobj
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/files/export_folder.h"
#include "client/cli/files/export_meta.h"
#include "client/cli/files/files.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/flags/blend_flags.h"
#include "client/cli/flags/encoding_flags.h"
#include "client/cli/flags/named_value.h"
#include "client/cli/flags/number_checks.h"
#include "client/cli/flags/parse.h"
#include "client/cli/flags/surface_flags.h"
#include "client/cli/flags/version_flag.h"
#include "client/cli/print/json.h"
#include "client/cli/print/progress_bar.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

constexpr int kExportBits = 20;  // the finest grid there is: 2 micrometres in a box of 2 metres

struct ExportFlags {
  std::string family;
  int64_t version = 0;  // 0: the published one
  BlendFlags blend;
  std::string directory;
  std::string format = "ply";
  bool overwrite = false;
  double frames_per_second = 0.0;  // 0: the family's
  EncodingFlags encoding = {.position_bits = kExportBits};
  SurfaceFlags surface;
};

struct ExportResult {
  std::vector<std::string> names;  // of the frames' files
  std::vector<double> times_s;
  int64_t version = 0;
  std::vector<double> weights;
  bool extrapolated = false;
  bool clamped = false;
};

ExportedFiles FilesOf(const std::string& format, size_t count) {
  const auto num_files = static_cast<int64_t>(count);
  if (format == "bobj") return {"fluid_mesh_", ".bobj.gz", num_files};
  return {"frame_", "." + format, num_files};
}

// All of one version: the one that says the rate and what is up.
StreamSettings ToSettings(const ExportFlags& flags, const Family& family, const Blend& blend) {
  StreamSettings settings;
  settings.family = family.name;
  settings.version = family.version;
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

absl::Status WriteOne(const Frame& frame, const ExportFolder& folder, const ExportFlags& flags,
                      ExportResult& result) {
  LBC_ASSIGN_OR_RETURN(const Mesh mesh, DecodeMesh(frame.data));
  const ExportedFiles files = FilesOf(flags.format, result.names.size() + 1);
  result.names.push_back(files.NameOf(files.count));
  LBC_RETURN_IF_ERROR(WriteMeshFile(mesh, folder.TemporaryPath(result.names.back())));
  result.times_s.push_back(frame.time_s);
  result.version = frame.version;
  result.weights = frame.weights;
  result.extrapolated = frame.extrapolated;
  result.clamped = frame.clamped;
  return absl::OkStatus();
}

// Reads the stream to its end, one file per frame.
absl::StatusOr<ExportResult> WriteFrames(FrameStream& stream, const ExportFolder& folder,
                                         const ExportFlags& flags, double duration_s,
                                         ProgressBar& bar) {
  ExportResult result;
  for (;;) {
    LBC_ASSIGN_OR_RETURN(const std::optional<StreamedFrame> streamed, stream.Read());
    if (!streamed) return result;
    LBC_RETURN_IF_ERROR(WriteOne(streamed->frame, folder, flags, result));
    const double time_s = streamed->frame.time_s;
    bar.Update(duration_s > 0.0 ? time_s / duration_s : 1.0, "export",
               absl::StrFormat("export, %.2f of %.2f s, %d files", time_s, duration_s,
                               result.names.size()));
  }
}

// meta.json, then all files at their place.
absl::Status Finish(const ExportResult& result, const Family& family, const ExportFlags& flags,
                    double frames_per_second, ExportFolder& folder) {
  if (result.names.empty()) {
    return absl::InternalError(absl::StrCat(family.name, ": the server sent no frames"));
  }
  const std::string meta =
      ToMetaJson({frames_per_second, result.times_s, family.name, result.version, result.weights,
                  family.up, FilesOf(flags.format, result.names.size())});
  LBC_RETURN_IF_ERROR(WriteFile(folder.TemporaryPath(kMetaName), meta));
  std::vector<std::string> names = result.names;
  names.push_back(kMetaName);
  return folder.Commit(names);
}

absl::Status RunExport(const ExportFlags& flags, const Context& context) {
  LBC_RETURN_IF_ERROR(CheckAttributes(flags.surface, flags.format));
  LBC_ASSIGN_OR_RETURN(const Blend blend, ToRequiredBlend(flags.blend));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Family family, client->GetFamily(flags.family, flags.version));
  LBC_ASSIGN_OR_RETURN(
      ExportFolder folder,
      ExportFolder::Open(flags.directory, flags.overwrite ? ExportFolder::Policy::kOverwrite
                                                          : ExportFolder::Policy::kMustBeEmpty));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<FrameStream> stream,
                       client->StreamFrames(ToSettings(flags, family, blend)));
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  LBC_ASSIGN_OR_RETURN(const ExportResult result,
                       WriteFrames(*stream, folder, flags, family.duration_s, bar));
  bar.Finish();
  const double frames_per_second =
      flags.frames_per_second > 0.0 ? flags.frames_per_second : family.frames_per_second;
  LBC_RETURN_IF_ERROR(Finish(result, family, flags, frames_per_second, folder));
  const std::string first_file = folder.FinalPath(result.names[0]);
  context.Print(absl::StrCat(result.names.size(), " files, from ", first_file, " on: ", family.name,
                             " version ", result.version, ", weights ",
                             DescribeWeights(result.weights, result.extrapolated, result.clamped)));
  context.PrintJson({{"directory", flags.directory},
                     {"first_file", first_file},
                     {"num_files", result.names.size()},
                     {"family", family.name},
                     {"version", result.version},
                     {"weights", result.weights},
                     {"extrapolated", result.extrapolated},
                     {"clamped", result.clamped},
                     {"frames_per_second", frames_per_second}});
  return absl::OkStatus();
}

}  // namespace

void AddExport(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<ExportFlags>();
  CLI::App* command =
      app.add_subcommand("export", "Write every frame of a blend to a directory, a file each");
  command->add_option("FAMILY", flags->family, "The family's id")->required();
  AddVersionFlag(flags->version, *command);
  AddBlendFlags(*command, flags->blend);
  command->add_option("-o,--output", flags->directory, "DIR; made if needed, otherwise empty")
      ->required();
  command->add_flag("--overwrite", flags->overwrite,
                    "Replace the frames and the meta.json of an earlier export in DIR, once the "
                    "new ones are all there; other files stay");
  AddNamedValue<std::string>(
      "--format", flags->format,
      "ply, obj or stl: frame_0001.ply; bobj: fluid_mesh_0001.bobj.gz, as Mantaflow's "
      "cache, but in metres; meta.json beside them says rate and units",
      {{"ply", "ply"}, {"obj", "obj"}, {"stl", "stl"}, {"bobj", "bobj"}}, *command)
      ->default_str(flags->format);
  command->add_option("--fps", flags->frames_per_second, "Frames per second; default the family's")
      ->check(Positive());
  AddEncodingFlags(*command, flags->encoding);
  AddSurfaceFlags(*command, flags->surface);
  command->callback([flags, &context] { context.status = RunExport(*flags, context); });
}

}  // namespace liquidblend::cli
