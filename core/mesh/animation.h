// A simulated liquid: one closed triangle mesh a frame.
#pragma once

#include <string>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace liquidblend::mesh {

// Frames have consecutive numbers; frame k shows the time k / frames_per_second since the first.
struct Animation {
  std::string name;
  double frames_per_second = 24.0;   // > 0
  int first_frame_number = 1;        // as in the file names it came from
  std::vector<TriangleMesh> frames;  // each closed and oriented; world metres
  std::vector<std::string> notes;    // what was cleaned on import, one sentence each

  int num_frames() const { return static_cast<int>(frames.size()); }
};

// Mean edge length over all frames, metres.
double MeanEdgeLength(const Animation& animation);

// Smallest box around all frames: column 0 the minimum, column 1 the maximum, metres.
Eigen::Matrix<float, 3, 2> Bounds(const Animation& animation);

}  // namespace liquidblend::mesh
