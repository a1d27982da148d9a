// Report of an animation's space-time mesh: its figures, and its fidelity to the animation.
#pragma once

#include <cstdint>

namespace liquidblend::mesh {

// Differences of slices of the undeformed mesh at frames from these frames.
struct Fidelity {
  int num_frames = 0;                // that were measured, spread over the animation
  double mean_distance_edges = 0.0;  // between the surfaces, both ways, in mean edge lengths
  double max_distance_edges = 0.0;   // of the points that were measured
  double max_volume_error = 0.0;     // of a frame, as a share of the larger of the two volumes
  int64_t num_components = 0;        // of the measured frames, together
  int64_t num_components_shown = 0;  // of their slices
  int64_t max_component_error = 0;   // how many more or fewer a single slice has

  // Calls visit(name, figure) for each figure, named as in both messages Fidelity.
  template <typename Self, typename Visit>
  static void ForEachFigure(Self& self, const Visit& visit) {
    visit("num_frames", self.num_frames);
    visit("mean_distance_edges", self.mean_distance_edges);
    visit("max_distance_edges", self.max_distance_edges);
    visit("max_volume_error", self.max_volume_error);
    visit("num_components", self.num_components);
    visit("num_components_shown", self.num_components_shown);
    visit("max_component_error", self.max_component_error);
  }
};

// Figures of a space-time mesh: its size, its parts and its fidelity.
struct SpaceTimeReport {
  bool is_tracked = false;      // frames share connectivity; otherwise on a grid of ...
  double grid_spacing_m = 0.0;  // ... this spacing; 0 if tracked
  double edge_length_m = 0.0;   // mean edge length of the animation
  int64_t num_vertices = 0;
  int64_t num_tetrahedra = 0;
  int64_t num_pyramids = 0;
  int64_t num_wedges = 0;
  int64_t num_hexahedra = 0;
  int64_t num_droplets = 0;      // carried as rigid pieces
  int64_t num_rigid_pieces = 0;  // droplets at single times
  double thin_share = 0.0;       // of the vertices, those of thin sheets
  Fidelity fidelity;

  // Calls visit(name, figure) for each number, named as in both messages SpaceTimeReport.
  template <typename Self, typename Visit>
  static void ForEachFigure(Self& self, const Visit& visit) {
    visit("grid_spacing_m", self.grid_spacing_m);
    visit("edge_length_m", self.edge_length_m);
    visit("num_vertices", self.num_vertices);
    visit("num_tetrahedra", self.num_tetrahedra);
    visit("num_pyramids", self.num_pyramids);
    visit("num_wedges", self.num_wedges);
    visit("num_hexahedra", self.num_hexahedra);
    visit("num_droplets", self.num_droplets);
    visit("num_rigid_pieces", self.num_rigid_pieces);
    visit("thin_share", self.thin_share);
  }
};

}  // namespace liquidblend::mesh
