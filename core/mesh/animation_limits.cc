#include "core/mesh/animation_limits.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace liquidblend::mesh {
namespace {

constexpr double kMinStep = 0.001;
constexpr double kResolution = 0x1p-20;  // of a time; a float has 24 bits

absl::Status OfFrame(const Animation& animation, int k, const std::string& message) {
  return absl::InvalidArgumentError(
      absl::StrCat("animation '", animation.name, "', frame ", k, ": ", message));
}

}  // namespace

double SmallestStep(double time) { return std::max(kMinStep, kResolution * time); }

absl::Status CheckTimes(const Animation& animation) {
  for (int k = 0; k < animation.num_frames(); ++k) {
    const double time = animation.time(k);
    const double first = -animation.num_pre_roll;
    if (!(time >= first && time <= kLongestTime)) {
      return OfFrame(
          animation, k,
          absl::StrCat("its time is ", time, " frames, not in [", first, ", ", kLongestTime, "]"));
    }
    if (k == 0) continue;
    const double step = time - animation.time(k - 1);
    if (step >= SmallestStep(time) && step <= kLongestGap) continue;
    return OfFrame(animation, k,
                   absl::StrCat("it comes ", step, " frames after the one before, not in [",
                                SmallestStep(time), ", ", kLongestGap, "]"));
  }
  return absl::OkStatus();
}

absl::Status CheckExtent(const Animation& animation) {
  float largest_m = 0.0F;
  const TriangleMesh* first = nullptr;
  int64_t num_triangles = 0;
  for (const TriangleMesh& frame : animation.frames) {
    if (frame.num_vertices() == 0) continue;
    largest_m = std::max(largest_m, frame.vertices.cwiseAbs().maxCoeff());
    if (first == nullptr) first = &frame;
    num_triangles += frame.num_triangles();
  }
  if (first == nullptr) return absl::OkStatus();
  // The mean edge length of one frame gives a lower bound of the mean over all. With it only
  // extreme scenes need the measurement of the other frames.
  const double share = static_cast<double>(first->num_triangles()) /
                       static_cast<double>(std::max<int64_t>(num_triangles, 1));
  if (largest_m <= kLargestExtentEdges * MeanEdgeLength(*first) * share) return absl::OkStatus();
  const double limit_m = kLargestExtentEdges * MeanEdgeLength(animation);
  for (int k = 0; k < animation.num_frames(); ++k) {
    const TriangleMesh& frame = animation.frames[k];
    if (frame.num_vertices() == 0) continue;
    const double frame_largest_m = frame.vertices.cwiseAbs().maxCoeff();
    if (frame_largest_m <= limit_m) continue;
    return OfFrame(animation, k,
                   absl::StrCat("a coordinate of ", frame_largest_m, " m is beyond ",
                                kLargestExtentEdges, " mean edge lengths, ", limit_m, " m"));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::mesh
