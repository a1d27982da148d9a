// Animations whose frames share connectivity, wholly or mostly, with exact velocities: what a
// surface tracker writes.
#pragma once

#include <cstdint>

#include "core/mesh/animation.h"

namespace liquidblend::synthetic {

struct TrackedSequenceOptions {
  int num_frames = 8;               // >= 2
  int subdivisions = 3;             // >= 1; of the icospheres that it starts from
  double frames_per_second = 24;    // > 0
  double stretch_per_frame = 0.05;  // of the x axis; the others shrink by half as much
};

// A unit sphere that becomes an ellipsoid; all frames have the same triangles.
mesh::Animation SphereToEllipsoid(const TrackedSequenceOptions& options = {});

struct RemeshingOptions {
  TrackedSequenceOptions sequence;
  int flips_per_frame = 6;      // >= 0
  int splits_per_frame = 6;     // >= 0
  int collapses_per_frame = 6;  // >= 0; to the middle of the edge
  uint64_t seed = 1;
};

// The same motion; between two frames random edges are flipped, split and collapsed. A collapse
// renumbers the vertices behind the one that it removes.
mesh::Animation RemeshedEllipsoid(const RemeshingOptions& options = {});

// Two unit spheres that move towards one another, 1 edge a frame; half-way the caps that face one
// another are replaced by a tube.
mesh::Animation MergingSpheres(const TrackedSequenceOptions& options = {});

// The same backwards: one body becomes two.
mesh::Animation SplittingSpheres(const TrackedSequenceOptions& options = {});

// As SphereToEllipsoid(), but half-way the mesh is replaced by one that shares no vertex and no
// triangle.
mesh::Animation ReplacedEllipsoid(const TrackedSequenceOptions& options = {});

}  // namespace liquidblend::synthetic
