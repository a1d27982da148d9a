#include "core/mesh/whole_frames.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace liquidblend::mesh {
namespace {

void SortUnique(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

// The whole frames at or before the vertices' times, without repetitions. Vertices come by slabs,
// so most repetitions are adjacent.
std::vector<double> EarlierFrames(const SpaceTimeMesh& mesh) {
  std::vector<double> frames;
  for (int64_t v = 0; v < mesh.num_vertices(); ++v) {
    const double frame = std::floor(mesh.vertices(3, v));
    if (frames.empty() || frames.back() != frame) frames.push_back(frame);
  }
  SortUnique(frames);
  return frames;
}

std::vector<double> Thinned(const std::vector<double>& frames) {
  if (frames.size() <= kMostWholeFrames) return frames;
  std::vector<double> chosen;
  for (size_t n = 0; n < kMostWholeFrames; ++n) {
    chosen.push_back(frames[n * (frames.size() - 1) / (kMostWholeFrames - 1)]);
  }
  return chosen;
}

}  // namespace

std::vector<double> WholeFrames(const SpaceTimeMesh& mesh) {
  std::vector<double> frames;
  for (const double frame : EarlierFrames(mesh)) {
    for (const double near : {frame, frame + 1}) {
      if (near >= 0 && near <= mesh.num_frames - 1) frames.push_back(near);
    }
  }
  SortUnique(frames);
  return Thinned(frames);
}

}  // namespace liquidblend::mesh
