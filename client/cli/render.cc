// liquidblend render FAMILY | --files FILE ...
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "client/cli/commands.h"
#include "client/cli/files/export_meta.h"
#include "client/cli/files/files.h"
#include "client/cli/files/mesh_file.h"
#include "client/cli/files/mesh_stats.h"
#include "client/cli/flags/blend_flags.h"
#include "client/cli/flags/parse.h"
#include "client/cli/flags/up_flag.h"
#include "client/cli/flags/version_flag.h"
#include "client/cli/print/json.h"
#include "client/cli/print/progress_bar.h"
#include "client/cli/render/sheet.h"
#include "client/cli/render/upright.h"
#include "client/cli/render/water.h"
#include "client/src/status_macros.h"
#include "liquidblend/decode.h"

namespace liquidblend::cli {
namespace {

using render::Image;
using render::Sheet;
using render::WaterOptions;

struct RenderFlags {
  std::string family;
  int64_t version = 0;                  // 0: the published one
  std::vector<std::string> weights;     // one per row
  std::vector<std::string> parameters;  // likewise, below those
  bool extrapolate = false;
  std::string times;
  int num_columns = 6;
  std::vector<std::string> files;
  std::string output;
  std::string size = "320x240";
  std::string camera;
  Up up = Up::kUnknown;  // kUnknown: the family's; of files their meta.json's
  int samples_per_side = 3;
};

absl::StatusOr<WaterOptions> ToWaterOptions(const RenderFlags& flags) {
  WaterOptions options;
  const std::vector<std::string> size = absl::StrSplit(flags.size, 'x');
  if (size.size() != 2 || !absl::SimpleAtoi(size[0], &options.width) ||
      !absl::SimpleAtoi(size[1], &options.height)) {
    return absl::InvalidArgumentError(
        absl::StrCat("--size ", flags.size, ": write WIDTHxHEIGHT, for example 320x240"));
  }
  if (!flags.camera.empty()) {
    LBC_ASSIGN_OR_RETURN(const std::vector<double> camera, ParseNumbers("--camera", flags.camera));
    if (camera.size() != 2 && camera.size() != 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("--camera ", flags.camera, ": write AZIMUTH,ELEVATION[,ZOOM]"));
    }
    options.camera.azimuth_deg = camera[0];
    options.camera.elevation_deg = camera[1];
    if (camera.size() == 3) options.camera.zoom = camera[2];
  }
  options.samples_per_side = flags.samples_per_side;
  LBC_RETURN_IF_ERROR(options.Validate());
  return options;
}

void Extend(const Bounds& box, Bounds* bounds) {
  bounds->min = {std::min(bounds->min.x, box.min.x), std::min(bounds->min.y, box.min.y),
                 std::min(bounds->min.z, box.min.z)};
  bounds->max = {std::max(bounds->max.x, box.max.x), std::max(bounds->max.y, box.max.y),
                 std::max(bounds->max.z, box.max.z)};
}

// ---- local files ------------------------------------------------------------------------------

// The upward direction in the meta.json beside the file; kUnknown if it has none or is missing.
Up UpBeside(const std::string& file) {
  const std::filesystem::path meta = std::filesystem::path(file).parent_path() / kMetaName;
  const absl::StatusOr<std::string> bytes = ReadFile(meta.string());
  return bytes.ok() ? UpIn(*bytes) : Up::kUnknown;
}

absl::StatusOr<std::vector<Mesh>> ReadMeshes(const RenderFlags& flags, const Context& context) {
  std::vector<Mesh> meshes;
  std::string assumed;
  for (const std::string& file : flags.files) {
    LBC_ASSIGN_OR_RETURN(Mesh mesh, ReadMeshFile(file));
    const Up up = flags.up != Up::kUnknown ? flags.up : UpBeside(file);
    if (up == Up::kUnknown && assumed.empty()) assumed = file;
    meshes.push_back(render::Upright(std::move(mesh), up));
  }
  if (!assumed.empty()) {
    context.Remark(
        absl::StrCat("Assumed that z is up in ", assumed,
                     ": no meta.json beside it gives the direction; --up overrides it."));
  }
  return meshes;
}

// One cell per file, left to right, with the file's name above it if there is one row only.
absl::StatusOr<Sheet> RenderFiles(const RenderFlags& flags, const WaterOptions& options,
                                  const Context& context, ProgressBar& bar) {
  LBC_ASSIGN_OR_RETURN(const std::vector<Mesh> meshes, ReadMeshes(flags, context));
  Bounds bounds = ComputeMeshStats(meshes[0]).bounds;
  for (const Mesh& mesh : meshes) Extend(ComputeMeshStats(mesh).bounds, &bounds);
  Sheet sheet;
  const auto num_columns = static_cast<size_t>(flags.num_columns);
  for (size_t i = 0; i < meshes.size(); ++i) {
    bar.Update(static_cast<double>(i) / static_cast<double>(meshes.size()), "render",
               absl::StrCat("render, ", flags.files[i]));
    if (i % num_columns == 0) sheet.rows.emplace_back();
    LBC_ASSIGN_OR_RETURN(Image image, render::RenderWater(meshes[i], bounds, options));
    sheet.rows.back().push_back(std::move(image));
    if (meshes.size() <= num_columns) {
      sheet.column_labels.push_back(std::filesystem::path(flags.files[i]).filename().string());
    }
  }
  return sheet;
}

// ---- a family on the server -------------------------------------------------------------------

struct Plan {
  Family family;
  Up up = Up::kUnknown;
  std::vector<Blend> blends;    // one row each
  std::vector<double> times_s;  // one column each
};

// Without --weights and --parameters: from the source to the first target in four steps.
absl::StatusOr<std::vector<Blend>> PlanRows(const RenderFlags& flags, const Family& family) {
  std::vector<Blend> rows;
  for (const std::string& text : flags.weights) {
    LBC_ASSIGN_OR_RETURN(Blend row, ToBlend({text, "", false}));
    rows.push_back(std::move(row));
  }
  for (const std::string& text : flags.parameters) {
    LBC_ASSIGN_OR_RETURN(Blend row, ToBlend({"", text, flags.extrapolate}));
    rows.push_back(std::move(row));
  }
  if (!rows.empty()) return rows;
  for (const double weight : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    rows.emplace_back().weights.assign(std::max<size_t>(family.targets.size(), 1), 0.0);
    rows.back().weights[0] = weight;
  }
  return rows;
}

absl::StatusOr<std::vector<double>> PlanColumns(const RenderFlags& flags, const Family& family) {
  if (!flags.times.empty()) return ParseNumbers("--times", flags.times);
  std::vector<double> times;
  for (int i = 0; i < flags.num_columns; ++i) {
    const int steps = std::max(flags.num_columns - 1, 1);
    times.push_back(family.duration_s * i / steps);
  }
  return times;
}

// Of a name as long as the server likes: the picture is as wide as its labels.
std::string BaseId(const std::string& name) {
  constexpr size_t kMaxLetters = 64;
  return name.substr(name.find('/') + 1, kMaxLetters);
}

// The parameters a line each; or the weights, and the animation that they give back, if they do.
std::string RowLabel(const Blend& blend, const Family& family) {
  if (!blend.parameters.empty())
    return absl::StrJoin(blend.parameters, "\n", absl::PairFormatter(" "));
  const std::vector<double>& weights = blend.weights;
  std::string label = absl::StrCat("weight ", FormatNumbers(weights));
  const auto num_zeros = std::count(weights.begin(), weights.end(), 0.0);
  const auto one = std::find(weights.begin(), weights.end(), 1.0);
  const auto target = static_cast<size_t>(one - weights.begin());
  if (num_zeros == static_cast<int64_t>(weights.size())) {
    absl::StrAppend(&label, "\n", BaseId(family.source));
  } else if (num_zeros + 1 == static_cast<int64_t>(weights.size()) && one != weights.end() &&
             target < family.targets.size()) {
    absl::StrAppend(&label, "\n", BaseId(family.targets[target]));
  }
  return label;
}

absl::StatusOr<Image> RenderBlend(Client& client, const Plan& plan, size_t row, size_t column,
                                  const WaterOptions& options) {
  FrameRequest request;
  request.family = plan.family.name;
  request.version = plan.family.version;
  request.weights = plan.blends[row].weights;
  request.parameters = plan.blends[row].parameters;
  request.extrapolate = plan.blends[row].extrapolate;
  request.time_s = plan.times_s[column];
  LBC_ASSIGN_OR_RETURN(const Frame frame, client.GetFrame(request));
  LBC_ASSIGN_OR_RETURN(Mesh mesh, DecodeMesh(frame.data));
  return render::RenderWater(render::Upright(std::move(mesh), plan.up),
                             render::Upright(plan.family.bounds, plan.up), options);
}

absl::StatusOr<Sheet> RenderPlan(Client& client, const Plan& plan, const WaterOptions& options,
                                 ProgressBar& bar) {
  Sheet sheet;
  const size_t num_tiles = plan.blends.size() * plan.times_s.size();
  for (const double time_s : plan.times_s) {
    sheet.column_labels.push_back(absl::StrFormat("%.2f s", time_s));
  }
  for (size_t row = 0; row < plan.blends.size(); ++row) {
    sheet.row_labels.push_back(RowLabel(plan.blends[row], plan.family));
    sheet.rows.emplace_back();
    for (size_t column = 0; column < plan.times_s.size(); ++column) {
      const size_t tile = row * plan.times_s.size() + column;
      bar.Update(static_cast<double>(tile) / static_cast<double>(num_tiles), "render",
                 absl::StrCat("render, picture ", tile + 1, "/", num_tiles));
      LBC_ASSIGN_OR_RETURN(Image image, RenderBlend(client, plan, row, column, options));
      sheet.rows.back().push_back(std::move(image));
    }
  }
  return sheet;
}

absl::StatusOr<Sheet> RenderFamily(const RenderFlags& flags, const WaterOptions& options,
                                   const Context& context, ProgressBar& bar) {
  LBC_ASSIGN_OR_RETURN(const std::unique_ptr<Client> client, context.Connect());
  Plan plan;
  LBC_ASSIGN_OR_RETURN(plan.family, client->GetFamily(flags.family, flags.version));
  plan.up = flags.up != Up::kUnknown ? flags.up : plan.family.up;
  LBC_ASSIGN_OR_RETURN(plan.blends, PlanRows(flags, plan.family));
  LBC_ASSIGN_OR_RETURN(plan.times_s, PlanColumns(flags, plan.family));
  return RenderPlan(*client, plan, options, bar);
}

// -----------------------------------------------------------------------------------------------

absl::Status RunRender(const RenderFlags& flags, const Context& context) {
  if (flags.family.empty() == flags.files.empty()) {
    return absl::InvalidArgumentError("render needs either a FAMILY or --files FILE ...");
  }
  if (Extension(flags.output) != "png") {
    return absl::InvalidArgumentError(absl::StrCat("-o ", flags.output, ": must end in .png"));
  }
  LBC_RETURN_IF_ERROR(CheckOutput(flags.output));
  LBC_ASSIGN_OR_RETURN(const WaterOptions options, ToWaterOptions(flags));
  ProgressBar bar(ProgressBar::ChooseStyle(context.quiet));
  absl::StatusOr<Sheet> sheet = flags.files.empty() ? RenderFamily(flags, options, context, bar)
                                                    : RenderFiles(flags, options, context, bar);
  LBC_RETURN_IF_ERROR(sheet.status());
  bar.Update(1.0, "done", "done");
  bar.Finish();
  LBC_ASSIGN_OR_RETURN(const Image image, render::Compose(*sheet));
  LBC_ASSIGN_OR_RETURN(const std::string png, render::ToPng(image));
  LBC_RETURN_IF_ERROR(WriteFile(flags.output, png));
  context.Print(absl::StrCat(flags.output, ": ", image.width, " x ", image.height, " pixels"));
  context.PrintJson({{"file", flags.output}, {"width", image.width}, {"height", image.height}});
  return absl::OkStatus();
}

}  // namespace

void AddRender(CLI::App& app, Context& context) {
  const auto flags = std::make_shared<RenderFlags>();
  CLI::App* command = app.add_subcommand(
      "render", "Draw a contact sheet: blends down, times across, ray-traced, as PNG");
  command->add_option("FAMILY", flags->family, "The family's id");
  AddVersionFlag(flags->version, *command);
  command
      ->add_option("--weights,-w", flags->weights,
                   "W[,W..] of one row; repeat for more rows; default 0, 0.25, 0.5, 0.75, 1")
      ->allow_extra_args(false);
  CLI::Option* parameters =
      command->add_option("--parameters,-p", flags->parameters, kParametersHelp)
          ->allow_extra_args(false);
  command->add_flag("--extrapolate", flags->extrapolate, kExtrapolateHelp)->needs(parameters);
  CLI::Option* times = command->add_option(
      "--times", flags->times, "T[,T..] in seconds: one column each; otherwise by --columns");
  command
      ->add_option("--columns", flags->num_columns,
                   "That many columns, evenly spread over the time; or pictures in a row of files")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->excludes(times);
  command->add_option("--files", flags->files, "Mesh files to draw; otherwise FAMILY");
  command->add_option("-o,--output", flags->output, "FILE.png")->required();
  command->add_option("--size", flags->size, "Pixels of one picture, WxH")->capture_default_str();
  command->add_option("--camera", flags->camera,
                      "AZIMUTH,ELEVATION[,ZOOM] in degrees; default 0,16,1: from the front");
  AddUp(flags->up,
        "Direction that is up; otherwise the family's, of files their meta.json's, else z",
        *command);
  command->add_option("--samples", flags->samples_per_side, "Rays per pixel, across and down each")
      ->check(CLI::Range(1, 16))
      ->capture_default_str();
  command->callback([flags, &context] { context.status = RunRender(*flags, context); });
}

}  // namespace liquidblend::cli
