#include "worker/registration/finish/part_volumes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "core/mesh/components.h"
#include "core/mesh/whole_frames.h"
#include "worker/registration/surface/blend_figures.h"
#include "worker/registration/surface/image_normals.h"

namespace liquidblend::registration {
namespace {

constexpr int kVolumeRounds = 3;
constexpr double kMaxOffset = 0.2;   // edges
constexpr double kMaxChange = 1.3;   // ratio of volumes within which a part is the same one
constexpr float kMinSpatial = 0.1f;  // as of match_volume.cc

using Slices = std::vector<std::vector<mesh::Component>>;  // per time

// Whole frames of the target in which a part is detached, within the source's frames.
std::vector<double> TimesOf(const PartMotions& motions, const mesh::SpaceTimeMesh& target,
                            int num_frames) {
  std::vector<double> times = mesh::WholeFrames(target);
  std::erase_if(times, [&](double time) {
    return time >= num_frames || std::none_of(motions.all().begin(), motions.all().end(),
                                              [time](const PartMotion& motion) {
                                                return time >= motion.target.start_time &&
                                                       time < motion.target.end_time &&
                                                       !motion.ends_at_start;
                                              });
  });
  return times;
}

// The component where the part is to be; null: none that near.
const mesh::Component* FindPart(const std::vector<mesh::Component>& components, const Track& track,
                                double time, double edge_length_m) {
  const Part part = track.At(time);
  const mesh::Component* nearest = nullptr;
  double least = part.radius() * edge_length_m;
  for (const mesh::Component& component : components) {
    const double distance = (component.centre - edge_length_m * part.centre.head<3>()).norm();
    if (!(distance < least) || !(component.volume > 0)) continue;
    nearest = &component;
    least = distance;
  }
  return nearest;
}

// In edges, outward; per time, none where the part is not found in both.
std::vector<std::optional<double>> OffsetsOf(const PartMotion& motion,
                                             std::span<const double> times, const Slices& moved,
                                             const Slices& target, double edge_length_m) {
  std::vector<std::optional<double>> offsets(times.size());
  for (size_t n = 0; n < times.size(); ++n) {
    const mesh::Component* const is = FindPart(moved[n], motion.target, times[n], edge_length_m);
    const mesh::Component* const wanted =
        FindPart(target[n], motion.target, times[n], edge_length_m);
    if (is == nullptr || wanted == nullptr) continue;
    if (std::abs(std::log(is->volume / wanted->volume)) > std::log(kMaxChange)) continue;
    const double offset = (wanted->volume - is->volume) / is->area / edge_length_m;
    if (std::abs(offset) <= kMaxOffset) offsets[n] = offset;
  }
  return offsets;
}

// Between the times that have one; zero without any.
double OffsetAt(const std::vector<std::optional<double>>& offsets, std::span<const double> times,
                double time) {
  std::optional<size_t> before, after;
  for (size_t n = 0; n < times.size() && !after; ++n) {
    if (!offsets[n]) continue;
    if (times[n] <= time) before = n;
    if (times[n] > time) after = n;
  }
  if (!before || !after) return before ? *offsets[*before] : after ? *offsets[*after] : 0.0;
  const double share = (time - times[*before]) / (times[*after] - times[*before]);
  return (1 - share) * *offsets[*before] + share * *offsets[*after];
}

}  // namespace

void MatchPartVolumes(const Surface& source, const PackedLists& neighbors, const Surface& target,
                      const PartMotions& motions, const parallel::Arena& arena,
                      Points& displacement) {
  const std::vector<double> times = TimesOf(motions, target.mesh, source.mesh.num_frames);
  if (times.empty()) return;
  const double edge = source.mesh.edge_length_m;
  const Slices wanted = ComponentsAt(target.mesh, target.mesh.vertices, times, arena);
  for (int round = 0; round < kVolumeRounds; ++round) {
    const Slices moved = ComponentsAt(source.mesh, BlendAt(source, displacement, 1), times, arena);
    std::vector<std::vector<std::optional<double>>> offsets;
    for (const PartMotion& motion : motions.all()) {
      offsets.push_back(OffsetsOf(motion, times, moved, wanted, edge));
    }
    Points correction = Points::Zero(4, displacement.cols());
    arena.For(displacement.cols(), [&](int64_t v) {
      const PartMotion* const motion = motions.Of(v);
      if (motion == nullptr || motion->ends_at_start) return;
      const double time = source.points(3, v) + displacement(3, v);
      const double offset = OffsetAt(offsets[motion - motions.all().data()], times, time);
      const Eigen::Vector3f normal = ImageNormal(source, neighbors, displacement, 1, v).head<3>();
      correction.col(v).head<3>() =
          static_cast<float>(offset) * normal / std::max(normal.norm(), kMinSpatial);
    });
    displacement += correction;
  }
}

}  // namespace liquidblend::registration
