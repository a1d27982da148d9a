// liquidblend export FAMILY --weights W[,W..] | --parameters NAME=VALUE[,..] -o DIR --format
// ply|obj|stl|bobj|gltf|usda|vat|vdb
#include <filesystem>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/export/blend_curve.h"
#include "client/cli/export/frame_source.h"
#include "client/cli/export/frame_writer.h"
#include "client/cli/files/export_folder.h"
#include "client/cli/files/export_meta.h"
#include "client/cli/files/files.h"
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

namespace liquidblend::cli {
namespace {

constexpr size_t kMaxWeights = 100'000'000;  // of all frames

constexpr int kExportBits = 20;  // the finest grid there is: 2 micrometres in a box of 2 metres

struct ExportFlags {
  std::string family;
  int64_t version = 0;  // 0: the published one
  BlendFlags blend;
  std::string directory;
  bool overwrite = false;
  double frames_per_second = 0.0;  // 0: the family's
  EncodingFlags encoding = {.position_bits = kExportBits};
  SurfaceFlags surface;
  WriterSettings writer;
};

struct ExportResult {
  ExportedFiles files;
  std::vector<double> times_s;
  int64_t version = 0;
  std::vector<std::vector<double>> weights;  // of each frame; of a constant blend the first one's
  size_t num_weights = 0;                    // of all frames
  bool extrapolated = false;                 // some frame
  bool clamped = false;                      // some frame
};

// All of one version: the one that says the rate and what is up.
StreamSettings ToSettings(const ExportFlags& flags, const Family& family) {
  StreamSettings settings;
  settings.family = family.name;
  settings.version = family.version;
  SetEncoding(flags.encoding, settings);
  settings.surface = ToSurfaceOptions(flags.surface);
  if (flags.frames_per_second > 0.0) settings.frames_per_second = flags.frames_per_second;
  return settings;
}

absl::Status Note(const Frame& frame, bool is_constant, ExportResult& result) {
  result.times_s.push_back(frame.time_s);
  result.version = frame.version;
  if (!is_constant || result.weights.empty()) {
    result.num_weights += frame.weights.size();
    result.weights.push_back(frame.weights);
  }
  result.extrapolated = result.extrapolated || frame.extrapolated;
  result.clamped = result.clamped || frame.clamped;
  if (result.num_weights <= kMaxWeights) return absl::OkStatus();
  return absl::DataLossError("the server sends frames of too many weights");
}

// Reads the frames to their end.
absl::StatusOr<ExportResult> WriteFrames(FrameSource& source, const Family& family,
                                         bool is_constant, FrameWriter& writer, ProgressBar& bar) {
  ExportResult result;
  for (;;) {
    LBC_ASSIGN_OR_RETURN(const std::optional<Frame> frame, source.Next());
    if (!frame) break;
    LBC_RETURN_IF_ERROR(writer.Add(*frame));
    LBC_RETURN_IF_ERROR(Note(*frame, is_constant, result));
    bar.Update(family.duration_s > 0.0 ? frame->time_s / family.duration_s : 1.0, "export",
               absl::StrFormat("export, %.2f of %.2f s, %d frames", frame->time_s,
                               family.duration_s, result.times_s.size()));
  }
  if (result.times_s.empty()) {
    return absl::InternalError(absl::StrCat(family.name, ": the server sent no frames"));
  }
  LBC_ASSIGN_OR_RETURN(result.files, writer.Finish());
  return result;
}

// meta.json, then all files at their place.
absl::Status Finish(const ExportResult& result, const Family& family, double frames_per_second,
                    ExportFolder& folder) {
  const std::string meta = ToMetaJson({frames_per_second, result.times_s, family.name,
                                       result.version, result.weights, family.up, result.files});
  LBC_RETURN_IF_ERROR(WriteFile(folder.TemporaryPath(kMetaName), meta));
  std::vector<std::string> names = result.files.Names();
  names.push_back(kMetaName);
  return folder.Commit(names);
}

// "0.5", or "0, 0 to 1, 0 along a curve".
std::string DescribeBlend(const ExportResult& result) {
  const auto describe = [&](const std::vector<double>& weights) {
    return DescribeWeights(weights, result.extrapolated, result.clamped);
  };
  if (result.weights.size() == 1) return describe(result.weights[0]);
  return absl::StrCat(FormatNumbers(result.weights.front()), " to ",
                      describe(result.weights.back()), " along a curve");
}

void PrintResult(const ExportFlags& flags, const ExportResult& result, double frames_per_second,
                 const std::string& family, const Context& context) {
  const std::vector<std::string> names = result.files.Names();
  const std::string first_file = (std::filesystem::path(flags.directory) / names[0]).string();
  const std::string what = names.size() == 1
                               ? absl::StrCat(first_file)
                               : absl::StrCat(names.size(), " files, from ", first_file, " on");
  context.Print(absl::StrCat(what, ": ", family, " version ", result.version, ", ",
                             result.times_s.size(), " frames, weights ", DescribeBlend(result)));
  context.PrintJson({{"directory", flags.directory},
                     {"first_file", first_file},
                     {"num_files", names.size()},
                     {"num_frames", result.times_s.size()},
                     {"family", family},
                     {"version", result.version},
                     {"weights", WeightsJson(result.weights)},
                     {"extrapolated", result.extrapolated},
                     {"clamped", result.clamped},
                     {"frames_per_second", frames_per_second}});
}

// `settings` must outlive the parser.
void AddFormatFlags(CLI::App& command, WriterSettings& settings) {
  AddNamedValue<std::string>(
      "--format", settings.format,
      "ply, obj or stl: frame_0001.ply; bobj: fluid_mesh_0001.bobj.gz, as Mantaflow's "
      "cache, but in metres; gltf: animation.glb; usda: animation.usda; vat: vat.json and "
      "textures; vdb: a level set a frame; meta.json beside them says rate and units",
      {{"ply", "ply"},
       {"obj", "obj"},
       {"stl", "stl"},
       {"bobj", "bobj"},
       {"gltf", "gltf"},
       {"usda", "usda"},
       {"vat", "vat"},
       {"vdb", "vdb"}},
      command)
      ->default_str(settings.format);
  AddNamedValue<Compression>("--compression", settings.compression,
                             "With --format gltf: draco has a fifth of the bytes, but not every "
                             "program reads it; none unless given",
                             {{"none", Compression::kNone}, {"draco", Compression::kDraco}},
                             command);
  command
      .add_option("--texture-size", settings.texture_size,
                  "With --format vat: the longest side of a texture")
      ->check(CLI::Range(1024, 16384))
      ->capture_default_str();
  command
      .add_option("--voxel-size", settings.voxel_size_m,
                  "With --format vdb: metres; the mean edge length of the first frame with liquid "
                  "unless given")
      ->check(Positive());
}

// Flags of one format, given with another.
absl::Status CheckFormatFlags(const WriterSettings& settings) {
  const auto refuse = [&](const char* flag, const char* format) {
    return absl::InvalidArgumentError(
        absl::StrCat(flag, " is for --format ", format, ", not for ", settings.format));
  };
  if (settings.compression != Compression::kNone && settings.format != "gltf") {
    return refuse("--compression draco", "gltf");
  }
  if (settings.voxel_size_m > 0.0 && settings.format != "vdb") return refuse("--voxel-size", "vdb");
  const bool has_size = settings.texture_size != WriterSettings().texture_size;
  if (has_size && settings.format != "vat") return refuse("--texture-size", "vat");
  return absl::OkStatus();
}

absl::Status RunExport(const ExportFlags& flags, const Context& context) {
  LBC_RETURN_IF_ERROR(CheckAttributes(flags.surface, flags.writer.format));
  LBC_RETURN_IF_ERROR(CheckFormatFlags(flags.writer));
  LBC_ASSIGN_OR_RETURN(const BlendCurve curve, ToBlendCurve(flags.blend));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  LBC_ASSIGN_OR_RETURN(const Family family, client->GetFamily(flags.family, flags.version));
  LBC_ASSIGN_OR_RETURN(
      ExportFolder folder,
      ExportFolder::Open(flags.directory, flags.overwrite ? ExportFolder::Policy::kOverwrite
                                                          : ExportFolder::Policy::kMustBeEmpty));
  WriterSettings settings = flags.writer;
  settings.frames_per_second =
      flags.frames_per_second > 0.0 ? flags.frames_per_second : family.frames_per_second;
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<FrameWriter> writer,
                       MakeFrameWriter(settings, family, folder));
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<FrameSource> source,
                       OpenFrames(*client, ToSettings(flags, family), curve,
                                  {settings.frames_per_second, family.duration_s}));
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  LBC_ASSIGN_OR_RETURN(ExportResult result,
                       WriteFrames(*source, family, curve.is_constant(), *writer, bar));
  bar.Finish();
  LBC_RETURN_IF_ERROR(Finish(result, family, settings.frames_per_second, folder));
  PrintResult(flags, result, settings.frames_per_second, family.name, context);
  return absl::OkStatus();
}

}  // namespace

void AddExport(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<ExportFlags>();
  CLI::App* command = app.add_subcommand(
      "export", "Write every frame of a blend to a directory, as mesh files or for other programs");
  command->add_option("FAMILY", flags->family, "The family's id")->required();
  AddVersionFlag(flags->version, *command);
  AddBlendFlags(*command, flags->blend);
  command->get_option("--weights")->description(kWeightsCurveHelp);
  command->get_option("--parameters")->description(kParametersCurveHelp);
  command->add_option("-o,--output", flags->directory, "DIR; made if needed, otherwise empty")
      ->required();
  command->add_flag("--overwrite", flags->overwrite,
                    "Replace the frames and the meta.json of an earlier export in DIR, once the "
                    "new ones are all there; other files stay");
  AddFormatFlags(*command, flags->writer);
  command->add_option("--fps", flags->frames_per_second, "Frames per second; default the family's")
      ->check(Positive());
  AddEncodingFlags(*command, flags->encoding);
  AddSurfaceFlags(*command, flags->surface);
  command->callback([flags, &context] { context.status = RunExport(*flags, context); });
}

}  // namespace liquidblend::cli
