// A simulated liquid: one closed triangle mesh a frame.
#pragma once

#include <string>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/mesh/up.h"

namespace liquidblend::mesh {

// An animation: its frames, their times and its frame rate. Frame k shows the time time(k) /
// frames_per_second since the first.
struct Animation {
  std::string name;
  double frames_per_second = 24.0;   // > 0
  int first_frame_number = 1;        // as in the file names it came from
  std::vector<TriangleMesh> frames;  // each closed and oriented; world metres
  // Frames since the first one, ascending from 0: gaps where frames are missing, fractions for
  // samples between frames. Empty: 0, 1, 2, ...
  std::vector<double> times;
  // So many of the frames, the first ones, are a pre-roll: made up, a frame apart, before the first
  // one that was simulated. Their times are negative.
  int num_pre_roll = 0;
  Up up = Up::kUnknown;
  std::vector<std::string> notes;  // what was cleaned on import, one sentence each

  // The number of frames, and the time of frame k in frames since the first one.
  int num_frames() const { return static_cast<int>(frames.size()); }
  double time(int k) const { return times.empty() ? k - num_pre_roll : times[k]; }
};

// Adds a pre-roll of `count` frames of this surface. Requires: there is none yet.
void AddPreRoll(const TriangleMesh& surface, int count, Animation& animation);

// Mean edge length over all frames but the pre-roll, metres.
double MeanEdgeLength(const Animation& animation);

// Smallest box around all frames: column 0 the minimum, column 1 the maximum, metres.
Eigen::Matrix<float, 3, 2> Bounds(const Animation& animation);

}  // namespace liquidblend::mesh
