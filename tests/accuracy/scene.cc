#include "tests/accuracy/scene.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/blend/blend.h"
#include "core/mesh/parameter_space.h"
#include "core/parameters/interpolator.h"
#include "tests/synthetic/implicit.h"
#include "worker/ingest/read_animation.h"
#include "worker/ingest/read_directory.h"

namespace liquidblend::accuracy {
namespace {

constexpr char kFallingDrop[] = "falling_drop";

struct StoredScene {
  std::string name;
  std::vector<std::string> inputs;
  std::string truth;
  std::vector<Middle> middles;
  int num_early_frames;
};

std::vector<StoredScene> StoredScenes() {
  return {{"two_drops", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"dam_break",
           {"w0_p0", "w1_p0", "w0_p1", "w1_p1"},
           "wm_pm",
           {{"bilinear, a quarter each", {0.25, 0.25, 0.25}},
            {"Delaunay, w0_p0 and w1_p1", {0, 0, 0.5}},
            {"Delaunay, w1_p0 and w0_p1", {0.5, 0.5, 0}}},
           36},
          {"crown", {"A", "B"}, "", {{"weight 0.5", {0.5}}}, 24},
          {"moved_drop", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"two_drops_bridged", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"throw", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 18},
          {"far_drop", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"crossing_drops", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"drop_size", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"block_length", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"inflow_start", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"moving_obstacle", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36},
          {"touching_drops", {"A", "B"}, "MID", {{"weight 0.5", {0.5}}}, 36}};
}

absl::StatusOr<mesh::Animation> Load(const std::string& path, const parallel::Arena& arena) {
  LB_ASSIGN_OR_RETURN(const auto files, ingest::LoadDirectory(path));
  return ingest::ReadAnimation(path.substr(path.rfind('/') + 1), ingest::Views(files), {}, arena);
}

// A scene of one parameter, whose middles are its truths' values by both interpolations.
struct FamilyScene {
  std::string name;
  std::string folder;
  std::string parameter;
  std::vector<std::pair<std::string, double>> inputs;
  std::vector<std::pair<std::string, double>> truths;
  int num_early_frames;
};

FamilyScene ThrowFamily() {
  return {"throw_family",
          "throw",
          "elevation",
          {{"MID", 30}, {"A", 10}, {"B", 50}},
          {{"at_20", 20}, {"at_40", 40}},
          18};
}

// A drop from three heights: the middle one hits the pool at the middle of the times.
Scene FallingDrops() {
  const auto drop = [](float height_m, const std::string& name) {
    synthetic::FallingDropOptions options;
    options.drop_m = {0, 0, height_m};
    mesh::Animation animation = synthetic::FallingDrop(options);
    animation.name = name;
    return animation;
  };
  Scene scene;
  scene.name = kFallingDrop;
  scene.inputs = {drop(0.45f, "low"), drop(0.65f, "high")};
  scene.truths = {drop(0.55f, "middle")};
  scene.middles = {{"weight 0.5", {0.5}}};
  scene.num_early_frames = 8;
  return scene;
}

absl::Status CheckFrames(const Scene& scene, const mesh::Animation& animation) {
  const int expected = scene.inputs[0].num_frames();
  if (animation.num_frames() == expected) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      scene.name, "/", animation.name, " has ", animation.num_frames(), " frames, not ", expected));
}

absl::Status AddInputs(const std::string& folder, const std::vector<std::string>& names,
                       const parallel::Arena& arena, Scene& scene) {
  for (const std::string& name : names) {
    LB_ASSIGN_OR_RETURN(mesh::Animation animation, Load(absl::StrCat(folder, "/", name), arena));
    scene.inputs.push_back(std::move(animation));
    LB_RETURN_IF_ERROR(CheckFrames(scene, scene.inputs.back()));
  }
  return absl::OkStatus();
}

absl::Status AddTruth(const std::string& folder, const std::string& name,
                      const parallel::Arena& arena, Scene& scene) {
  LB_ASSIGN_OR_RETURN(mesh::Animation animation, Load(absl::StrCat(folder, "/", name), arena));
  scene.truths.push_back(std::move(animation));
  return CheckFrames(scene, scene.truths.back());
}

// The weights that the server makes of each truth's value.
absl::Status AddMiddles(const FamilyScene& stored, mesh::Interpolation interpolation,
                        const std::string& label, Scene& scene) {
  mesh::ParameterSpace space = {{stored.parameter}, {}, interpolation};
  for (const auto& [name, value] : stored.inputs) space.points.push_back({value});
  LB_ASSIGN_OR_RETURN(const auto interpolator, parameters::Interpolator::Make(space));
  for (size_t n = 0; n < stored.truths.size(); ++n) {
    const double value = stored.truths[n].second;
    LB_ASSIGN_OR_RETURN(const parameters::Location location,
                        interpolator.Locate({&value, 1}, parameters::Outside::kRefuse,
                                            {blend::kMinWeight, blend::kMaxWeight}));
    scene.middles.push_back(
        {absl::StrCat(label, ", ", stored.parameter, " ", value), location.weights, n});
  }
  return absl::OkStatus();
}

absl::StatusOr<Scene> LoadFamily(const FamilyScene& stored, const std::string& folder,
                                 const parallel::Arena& arena) {
  Scene scene;
  scene.name = stored.name;
  std::vector<std::string> inputs;
  for (const auto& [name, value] : stored.inputs) inputs.push_back(name);
  LB_RETURN_IF_ERROR(AddInputs(folder, inputs, arena, scene));
  for (const auto& [name, value] : stored.truths) {
    LB_RETURN_IF_ERROR(AddTruth(folder, name, arena, scene));
  }
  LB_RETURN_IF_ERROR(AddMiddles(stored, mesh::Interpolation::kLinear, "linear", scene));
  LB_RETURN_IF_ERROR(AddMiddles(stored, mesh::Interpolation::kSmooth, "smooth", scene));
  scene.num_early_frames = std::min(stored.num_early_frames, scene.inputs[0].num_frames());
  return scene;
}

}  // namespace

std::vector<std::string> SceneNames() {
  std::vector<std::string> names = {kFallingDrop, ThrowFamily().name};
  for (const StoredScene& stored : StoredScenes()) names.push_back(stored.name);
  return names;
}

absl::StatusOr<Scene> LoadScene(const std::string& name, const std::string& folder,
                                const parallel::Arena& arena) {
  if (name == kFallingDrop) return FallingDrops();
  const FamilyScene family = ThrowFamily();
  if (name == family.name) {
    return LoadFamily(family, absl::StrCat(folder, "/", family.folder), arena);
  }
  const std::vector<StoredScene> known = StoredScenes();
  const auto stored =
      std::find_if(known.begin(), known.end(), [&](const auto& s) { return s.name == name; });
  if (stored == known.end()) return absl::NotFoundError(absl::StrCat("no scene '", name, "'"));
  Scene scene;
  scene.name = name;
  scene.middles = stored->middles;
  const std::string path = absl::StrCat(folder, "/", name);
  LB_RETURN_IF_ERROR(AddInputs(path, stored->inputs, arena, scene));
  if (!stored->truth.empty()) LB_RETURN_IF_ERROR(AddTruth(path, stored->truth, arena, scene));
  scene.num_early_frames = std::min(stored->num_early_frames, scene.inputs[0].num_frames());
  return scene;
}

}  // namespace liquidblend::accuracy
