// Space-time meshes of animations: options and reports.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace liquidblend {

enum class Connectivity {
  kAuto,     // in options: the server chooses; in reports: not known
  kTracked,  // frames share it, wholly or mostly: their own vertices are used
  kRebuilt,  // each frame has its own: a grid is laid over space and time
};

// Lengths are in mean edge lengths of the animation. Fields that are not set have the server's
// defaults.
struct SpaceTimeOptions {
  Connectivity connectivity = Connectivity::kAuto;
  double spacing_edges = 0.0;                   // >= 0; of the grid; 0: the server's default
  std::optional<int> droplet_vertices;          // >= 0; smaller components are rigid pieces
  std::optional<double> sheet_thickness_edges;  // >= 0; up to this sheets are thin; 0: none are
  std::optional<int> coarser_levels;            // >= 0; levels of detail beside the finest
  std::optional<bool> keep_thin_sheets;         // thinner than the spacing, untorn; true
  absl::Status Validate() const;                // names the first field out of range, and its value
};

// Differences of slices of an animation's undeformed space-time mesh at frames (of the source: at
// weight 0) from the frames.
struct Fidelity {
  int num_frames = 0;                // that were measured, spread over the animation
  double mean_distance_edges = 0.0;  // between the surfaces, both ways, in mean edge lengths
  double max_distance_edges = 0.0;   // of the points that were measured
  double max_volume_error = 0.0;     // of a frame, as a share of the larger of the two volumes
  int64_t num_components = 0;        // of the measured frames, together
  int64_t num_components_shown = 0;  // of their slices
  int64_t max_component_error = 0;   // how many more or fewer a single slice has
};

struct SpaceTimeReport {
  std::string animation;  // animations/{id}
  Connectivity connectivity = Connectivity::kAuto;
  double grid_spacing_m = 0.0;      // 0 if tracked
  double grid_spacing_edges = 0.0;  // in mean edge lengths of the animation
  double edge_length_m = 0.0;       // their mean
  int64_t num_vertices = 0;
  int64_t num_tetrahedra = 0;
  int64_t num_pyramids = 0;
  int64_t num_wedges = 0;
  int64_t num_hexahedra = 0;
  int64_t num_droplets = 0;      // carried as rigid pieces
  int64_t num_rigid_pieces = 0;  // droplets at single times
  double thin_share = 0.0;       // of the vertices: part of a thin sheet
  Fidelity fidelity;
};

}  // namespace liquidblend
