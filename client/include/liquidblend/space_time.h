// How animations become space-time meshes.
#pragma once

#include <optional>

#include "absl/status/status.h"

namespace liquidblend {

enum class Connectivity {
  kAuto,     // asked for: the server chooses; reported: not known
  kTracked,  // frames share it, wholly or mostly: their own vertices are used
  kRebuilt,  // each frame has its own: a grid is laid over space and time
};

// Lengths are in mean edge lengths of the animation. What is not set: the server's default.
struct SpaceTimeOptions {
  Connectivity connectivity = Connectivity::kAuto;
  double spacing_edges = 0.0;                   // >= 0; of the grid; 0: the server's default
  std::optional<int> droplet_vertices;          // >= 0; smaller components are rigid pieces
  std::optional<double> sheet_thickness_edges;  // >= 0; up to this sheets are thin; 0: none are
  std::optional<int> coarser_levels;            // >= 0; levels of detail beside the finest
  absl::Status Validate() const;                // names the first field out of range, and its value
};

}  // namespace liquidblend
