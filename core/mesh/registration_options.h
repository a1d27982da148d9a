// Options of a registration that users set. Checks, flags of the command line and
// docs/registration-options.md are generated from this list.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/mesh/option_ranges.h"

namespace liquidblend::mesh {

// Description of one option: its names, range and help text.
struct OptionInfo {
  const char* name;         // of the field in both messages RegistrationOptions
  const char* flag;         // of `liquidblend register`, without dashes
  Range range;              // of a value other than the default; of a bool: off, on
  const char* description;  // a phrase
};

// Values of the options, with their defaults. Lengths are in mean edge lengths of the source.
struct RegistrationOptions {
  int max_iterations = 20;
  int refine_iterations = 6;        // of a refinement, instead of max_iterations
  double node_spacing_edges = 5.0;  // between deformation nodes
  double sample_share = 0.1;        // of the vertices, in each iteration (section 6.2)
  double final_smoothness = 0.06;   // lambda of the last iteration
  double thin_sheets_from = 0.0;    // section 5.3
  uint64_t seed = 1;
  bool automatic_correspondences = true;  // after the user's

  // Calls visit(info, member...) for each option. One with two members sets both.
  template <typename Self, typename Visit>
  static void ForEach(Self& self, const Visit& visit) {
    visit(OptionInfo{"max_iterations",
                     "iterations",
                     {1, 200},
                     "Iterations per target; of a refinement 6 unless given"},
          self.max_iterations, self.refine_iterations);
    visit(OptionInfo{"node_spacing_edges",
                     "node-spacing",
                     {1, 100},
                     "Distance of deformation nodes in mean edge lengths"},
          self.node_spacing_edges);
    visit(OptionInfo{"sample_share",
                     "sample-share",
                     {1e-9, 1},
                     "Share of the vertices that are sampled in each iteration"},
          self.sample_share);
    visit(
        OptionInfo{
            "final_smoothness", "smoothness", {1e-9, 1e9}, "Smoothness at the last iteration"},
        self.final_smoothness);
    visit(OptionInfo{"thin_sheets_from",
                     "thin-sheets-from",
                     {0, 1},
                     "Share of the iterations before thin sheets take part, 1 for never"},
          self.thin_sheets_from);
    visit(OptionInfo{"seed", "seed", {0, 18446744073709551615.0}, "Seed of the random samples"},
          self.seed);
    visit(OptionInfo{"automatic_correspondences",
                     "automatic-correspondences",
                     {0, 1},
                     "Whether soft correspondences are found from what stands out in both "
                     "animations"},
          self.automatic_correspondences);
  }

  absl::Status Validate() const;  // names the first option out of range, and its value
};

}  // namespace liquidblend::mesh
