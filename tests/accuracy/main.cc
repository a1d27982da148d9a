// Registers scenes and prints how good their blends are. See run.sh.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/files/correspondences.h"
#include "core/base/memory.h"
#include "core/base/status_macros.h"
#include "tests/accuracy/registered_scene.h"
#include "tests/accuracy/report.h"
#include "tests/accuracy/scene.h"
#include "tests/paths.h"

namespace liquidblend::accuracy {
namespace {

using registration::Correspondence;
using registration::CorrespondenceKind;

struct Flags {
  std::vector<std::string> scenes;
  std::string data;
  std::string correspondences;
  int num_threads = 0;
  double required_gain = 0.0;
  std::string times = "auto";
  registration::RegistrationOptions registration;
  ReportOptions report;
};

void AddFlags(Flags& flags, CLI::App& app) {
  registration::RegistrationOptions& options = flags.registration;
  app.add_option("--scene", flags.scenes, "may be repeated; default: all")
      ->check(CLI::IsMember(SceneNames()));
  app.add_option("--data", flags.data, "folder with SCENE/INPUT/ (Mantaflow caches)")
      ->default_val(paths::Source("tests/data"));
  app.add_option("--correspondences", flags.correspondences,
                 "file as `liquidblend register --correspondences` takes it");
  app.add_option("--threads", flags.num_threads, "default: one per core");
  app.add_option("--require-gain", flags.required_gain,
                 "fail unless the best blend is this many times closer to the middle simulation "
                 "than the best baseline");
  app.add_option("--time-blending", flags.times, "auto, linear or squares")
      ->check(CLI::IsMember({"auto", "linear", "squares"}))
      ->capture_default_str();
  app.add_option("--iterations", options.max_iterations)->capture_default_str();
  app.add_option("--node-spacing", options.node_spacing_edges)->capture_default_str();
  app.add_option("--sample-share", options.sample_share)->capture_default_str();
  app.add_option("--kept-share", options.kept_share)->capture_default_str();
  app.add_option("--first-smoothness", options.first_smoothness)->capture_default_str();
  app.add_option("--final-smoothness", options.final_smoothness)->capture_default_str();
  app.add_option("--first-distance", options.first_distance_edges)->capture_default_str();
  app.add_option("--final-distance", options.final_distance_edges)->capture_default_str();
  app.add_option("--thin-sheets-from", options.thin_sheets_from)->capture_default_str();
  app.add_option("--coarse-vertices", options.coarse_vertices,
                 "of the meshes that large ones begin with")
      ->capture_default_str();
  app.add_option("--finer-from", options.finer_from_edges)->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--automatic-correspondences", options.automatic_correspondences, "on or off")
      ->capture_default_str();
  app.add_option("--frame-step", flags.report.distance_step, "of distances and volumes")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--each-frame", flags.report.each_frame, "distances of each frame, too");
  app.add_option("--fold-step", flags.report.fold_step, "frames from one measure to the next")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

Eigen::Vector4d EventOf(const Event& event, double frames_per_second) {
  return {event.position.x, event.position.y, event.position.z, event.time_s * frames_per_second};
}

Correspondence ToCorrespondence(const liquidblend::Correspondence& from, double frames_per_second) {
  Correspondence to;
  switch (from.kind) {
    case liquidblend::CorrespondenceKind::kPoint:
      to.kind = CorrespondenceKind::kPoint;
      break;
    case liquidblend::CorrespondenceKind::kTrajectory:
      to.kind = CorrespondenceKind::kTrajectory;
      break;
    case liquidblend::CorrespondenceKind::kSpace:
      to.kind = CorrespondenceKind::kSpace;
      break;
  }
  to.hard = from.hard;
  to.source = EventOf(from.source, frames_per_second);
  to.target = EventOf(from.target, frames_per_second);
  to.length_frames = from.length_s * frames_per_second;
  return to;
}

absl::StatusOr<std::vector<std::vector<Correspondence>>> ReadCorrespondences(const Flags& flags,
                                                                             const Scene& scene) {
  std::vector<std::vector<Correspondence>> result;
  if (flags.correspondences.empty()) return result;
  LB_ASSIGN_OR_RETURN(const auto lists, cli::ReadCorrespondences(flags.correspondences));
  if (lists.size() + 1 != scene.inputs.size()) {
    return absl::InvalidArgumentError(absl::StrCat(flags.correspondences, " has ", lists.size(),
                                                   " lists for ", scene.inputs.size() - 1,
                                                   " targets"));
  }
  for (const auto& list : lists) {
    auto& of_target = result.emplace_back();
    for (const auto& from : list) {
      of_target.push_back(ToCorrespondence(from, scene.inputs[0].frames_per_second));
    }
  }
  return result;
}

absl::Status Run(const std::string& name, const Flags& flags, const parallel::Arena& arena) {
  LB_ASSIGN_OR_RETURN(Scene scene, LoadScene(name, flags.data, arena));
  if (flags.times == "linear") scene.times = TimeKind::kLinear;
  if (flags.times == "squares") scene.times = TimeKind::kSquares;
  LB_ASSIGN_OR_RETURN(const auto correspondences, ReadCorrespondences(flags, scene));
  LB_ASSIGN_OR_RETURN(const RegisteredScene registered,
                      RegisteredScene::Register(scene, correspondences, flags.registration, arena));
  const Comparison comparison = PrintReport(scene, registered, flags.report, arena, std::cout);
  if (comparison.best_middle * flags.required_gain <= comparison.best_baseline) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat(name, ": the blend is ", comparison.best_middle,
                   " edges from the middle simulation, the ", "best baseline ",
                   comparison.best_baseline, ", less than ", flags.required_gain, " times that"));
}

}  // namespace
}  // namespace liquidblend::accuracy

int main(int argc, char** argv) {
  using namespace liquidblend;
  base::ReturnLargeBlocks();
  accuracy::Flags flags;
  CLI::App app("Registers scenes and prints how good their blends are, as Markdown tables.");
  accuracy::AddFlags(flags, app);
  CLI11_PARSE(app, argc, argv);
  if (flags.scenes.empty()) flags.scenes = accuracy::SceneNames();
  const parallel::Arena arena(flags.num_threads);
  bool all_well = true;
  for (const std::string& name : flags.scenes) {
    const absl::Status status = accuracy::Run(name, flags, arena);
    if (status.ok()) continue;
    std::cerr << name << ": " << status << "\n";
    all_well = false;
  }
  return all_well ? 0 : 1;
}
