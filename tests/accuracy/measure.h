// What is measured on the surfaces of a blend. Lengths in mean edges; frames count from 0.
#pragma once

#include <functional>
#include <vector>

#include "core/mesh/animation.h"
#include "core/mesh/triangle_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::accuracy {

// The surface at a frame, which may lie between whole ones. Called from several threads.
using SurfaceAt = std::function<mesh::TriangleMesh(double frame)>;

struct Means {
  double all = 0.0;                    // over all frames measured
  double early = 0.0;                  // over those before Frames::num_early
  std::vector<double> of_frames = {};  // measured ones, in their order
};

// Every step-th frame.
struct Frames {
  int num = 0;
  int num_early = 0;
  int step = 1;
};

// Mean symmetric point-to-surface distance to the frames of `truth`.
Means MeanDistance(const SurfaceAt& surface, const mesh::Animation& truth, const Frames& frames,
                   double edge_length_m, const parallel::Arena& arena);

// Share of the crossings of rays, half an edge apart, that touch winding numbers below 0; over all
// frames and half of those between.
double InvertedShare(const SurfaceAt& surface, const Frames& frames, double edge_length_m,
                     const parallel::Arena& arena);

// The half-way blend's volume against the mean of the inputs', relative.
struct VolumeError {
  double mean = 0.0;
  double largest = 0.0;
  int largest_at = 0;  // frame
};
VolumeError CompareVolumes(const SurfaceAt& surface,
                           const std::vector<const mesh::Animation*>& inputs, const Frames& frames,
                           const parallel::Arena& arena);

// Parts of more than one component while they are apart, drops in the air say.
struct ComponentErrors {
  int num_frames = 0;  // in which each of the others has the same number, more than one
  int num_alike = 0;   // and the blend, too
  // Of a component's volume against the mean of the others', relative, while the parts of the first
  // frame are apart: until the first frame in which a number of components is another one.
  double largest_error = 0;
  double mean_components = 0.0;         // of the blend over all frames
  double mean_components_others = 0.0;  // of the others
};
// Specks below a thousandth of the liquid are not counted.
ComponentErrors CompareComponents(const SurfaceAt& surface,
                                  const std::vector<const mesh::Animation*>& others,
                                  const Frames& frames, const parallel::Arena& arena);

}  // namespace liquidblend::accuracy
