// Verdict on a registration: whether it can be trusted, and whether the two animations were alike
// enough.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace liquidblend::mesh {

// Grade of a registration.
enum class Grade {
  kUnknown,       // an older program registered the family
  kGood,          // blends are as good as the method makes them
  kDoubtful,      // look at the worst region; correspondences may help
  kTooDifferent,  // blends will not look like either animation
};

// Grade of a registration, with the figures that it follows from.
struct Verdict {
  // Residuals below each of these have a bin, the rest the last one; mean edge lengths.
  static constexpr std::array<double, 6> kBinEnds = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0};

  Grade grade = Grade::kUnknown;
  std::string reason;  // a sentence: what decided, with its value and limit
  // Where that is worst: x, y, z in metres, time in frames; on the registered source.
  std::array<double, 4> worst = {0, 0, 0, 0};

  double fit_energy = 0.0;         // of the last iteration
  double smoothness_energy = 0.0;  // likewise
  // Shares of the registered source's vertices by their distance to the target; all bins and those
  // without any target of compatible normal near by add up to 1.
  std::array<double, 7> residual_histogram = {};
  double compatible_share = 0.0;  // of those vertices: the target near by faces the same way
  double covered_share = 0.0;  // of the target's vertices: the registered source is within an edge
  // Of the vertices of either animation, in the span of time where it is largest: those without a
  // counterpart within an edge that faces the same way.
  double unmatched_share = 0.0;
  double stretch = 0.0;         // mean change of the distances between neighbours, as a share
  double inverted_share = 0.0;  // of the surfaces at weights 0.5 and 1: inside out
  // Mean difference in the number of parts, specks not counted, at the same times as below: between
  // the blend at weight 1 and the target, or between a blend at weight 0.25, 0.5 or 0.75 and the
  // numbers that lie between both animations', whichever is larger.
  double component_error = 0.0;
  // How much lower the relief (craters, jets, waves) of a blend at weight 0.25, 0.5 or 0.75 is than
  // the mean of the two animations' with its weight, as a share, over the same times.
  double relief_loss = 0.0;
  // Parts that are detached in both animations from the first frame on, in blends at the same
  // weights; the largest over their lives. Distance from where they should be, in their diameters,
  // at most 1: not there.
  double part_shift = 0.0;
  double part_volume_error = 0.0;  // as a share
  double part_fall_error = 0.0;    // of the acceleration of free fall, as a share
  // The half-way blend's volume over the mean of the two animations', minus 1; at times evenly
  // spread from the first frame to the last.
  std::vector<double> volume_errors;

  // Calls visit(name, figure) for each number and list, named as in both messages Verdict.
  template <typename Self, typename Visit>
  static void ForEachFigure(Self& self, const Visit& visit) {
    visit("fit_energy", self.fit_energy);
    visit("smoothness_energy", self.smoothness_energy);
    visit("residual_histogram", self.residual_histogram);
    visit("compatible_share", self.compatible_share);
    visit("covered_share", self.covered_share);
    visit("unmatched_share", self.unmatched_share);
    visit("stretch", self.stretch);
    visit("inverted_share", self.inverted_share);
    visit("component_error", self.component_error);
    visit("relief_loss", self.relief_loss);
    visit("part_shift", self.part_shift);
    visit("part_volume_error", self.part_volume_error);
    visit("part_fall_error", self.part_fall_error);
    visit("volume_errors", self.volume_errors);
  }
};

}  // namespace liquidblend::mesh
