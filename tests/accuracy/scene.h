// Scenes to register, with what their blends are compared with.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"

namespace liquidblend::accuracy {

// Blend weights, one per target, that stand for the middle of the inputs.
struct Middle {
  std::string label;
  std::vector<double> weights;
};

enum class TimeKind { kLinear, kSquares };

struct Scene {
  std::string name;
  std::vector<mesh::Animation> inputs;   // the source, then the targets; all with as many frames
  std::optional<mesh::Animation> truth;  // the simulation of the middle; none: not known
  std::vector<Middle> middles;           // ways to say it in weights, at least one
  std::optional<TimeKind> times;         // how they blend; none: as the registrations suggest
  int num_early_frames = 0;              // later motion is chaotic
};

// Names that LoadScene() knows. "falling_drop" is made by tests/synthetic and needs no folder.
std::vector<std::string> SceneNames();

// Reads FOLDER/NAME/INPUT for each input of the scene and for its truth.
// Errors: kNotFound for an unknown scene; those of reading, with the path at fault.
absl::StatusOr<Scene> LoadScene(const std::string& name, const std::string& folder,
                                const parallel::Arena& arena);

}  // namespace liquidblend::accuracy
