// Scenes to register, with what their blends are compared with.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"

namespace liquidblend::accuracy {

// Blend weights, one per target, that stand for the middle of the inputs, or for another place
// between them.
struct Middle {
  std::string label;
  std::vector<double> weights;
  size_t truth = 0;  // which of the scene's truths it is compared with
};

enum class TimeKind { kLinear, kSquares };

struct Scene {
  std::string name;
  std::vector<mesh::Animation> inputs;  // the source, then the targets; all with as many frames
  std::vector<mesh::Animation> truths;  // simulations of the middles; none: not known
  std::vector<Middle> middles;          // ways to say them in weights, at least one
  std::optional<TimeKind> times;        // how they blend; none: as the registrations suggest
  int num_early_frames = 0;             // later motion is chaotic
};

// Names that LoadScene() knows. "falling_drop" is made by tests/synthetic and needs no folder.
std::vector<std::string> SceneNames();

// Reads FOLDER/NAME/INPUT for each input of the scene and for its truths. "throw_family" has the
// folder of "throw".
// Errors: kNotFound for an unknown scene; those of reading, with the path at fault.
absl::StatusOr<Scene> LoadScene(const std::string& name, const std::string& folder,
                                const parallel::Arena& arena);

}  // namespace liquidblend::accuracy
