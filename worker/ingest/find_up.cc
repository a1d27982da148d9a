#include "worker/ingest/find_up.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::ingest {
namespace {

constexpr double kMaxShare = 0.6;         // of the frame's volume; larger parts are the main body
constexpr double kMaxVolumeChange = 0.1;  // from frame to frame; a part that keeps its volume
constexpr double kReach = 1.0;            // radii; how far a part may be from where it is expected
constexpr size_t kMinSamples = 8;
constexpr double kNearMedian = 0.5;     // of the median's length ...
constexpr double kShareNear = 2.0 / 3;  // ... so many accelerations must lie
constexpr double kMinCosine = 0.94;     // 20 degrees
constexpr double kMinBendEdges = 2e-3;  // what bends the way from frame to frame by less is noise

struct Part {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();    // m, of the volume
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, mean over its vertices
  double volume = 0.0;
  int64_t num_vertices = 0;
  double radius() const { return std::cbrt(volume * 3 / (4 * M_PI)); }
};

// A part followed over two frames, and by which motion it came there.
struct PartStep {
  const Part* from = nullptr;
  const Part* to = nullptr;
};

// Detached parts of a frame that are neither bubbles nor the main body.
std::vector<Part> DetachedParts(const mesh::TriangleMesh& mesh) {
  const std::vector<int32_t> roots = mesh::ComponentRoots(mesh);
  absl::flat_hash_map<int32_t, size_t> number_of;
  std::vector<Part> parts;
  const auto part_of = [&](int32_t vertex) -> Part& {
    const auto [entry, is_new] = number_of.try_emplace(roots[vertex], parts.size());
    if (is_new) parts.emplace_back();
    return parts[entry->second];
  };
  const auto position = [&](int32_t v) -> Eigen::Vector3d {
    return mesh.vertices.col(v).cast<double>();
  };
  // Volumes and first moments of tetrahedra with their tips in the part's first vertex.
  for (int64_t c = 0; c < mesh.num_triangles(); ++c) {
    const auto corners = mesh.triangles.col(c);
    Part& part = part_of(corners[0]);
    const Eigen::Vector3d tip = position(roots[corners[0]]);
    const Eigen::Vector3d a = position(corners[0]) - tip, b = position(corners[1]) - tip,
                          d = position(corners[2]) - tip;
    const double volume = a.dot(b.cross(d)) / 6;
    part.volume += volume;
    part.centre += volume * (tip + (a + b + d) / 4);
  }
  for (int32_t v = 0; v < mesh.num_vertices(); ++v) {
    if (!number_of.contains(roots[v])) continue;  // no triangle has it
    Part& part = part_of(v);
    ++part.num_vertices;
    if (mesh.velocities.cols() > 0) part.velocity += mesh.velocities.col(v).cast<double>();
  }
  double total = 0;
  for (const Part& part : parts) total += std::max(0.0, part.volume);
  std::erase_if(parts, [&](const Part& part) {
    return !(part.volume > 0) || part.volume > kMaxShare * total;
  });
  for (Part& part : parts) {
    part.centre /= part.volume;
    part.velocity /= static_cast<double>(part.num_vertices);
  }
  return parts;
}

// The part of the next frame that is the same: the only one near where it is expected, and of its
// volume.
const Part* NextOf(const Part& part, const Eigen::Vector3d& expected,
                   const std::vector<Part>& next) {
  const Part* found = nullptr;
  for (const Part& candidate : next) {
    if ((candidate.centre - expected).norm() > kReach * part.radius()) continue;
    if (found != nullptr) return nullptr;
    found = &candidate;
  }
  if (found == nullptr || std::abs(found->volume - part.volume) > kMaxVolumeChange * part.volume) {
    return nullptr;
  }
  return found;
}

// Accelerations of the parts from frame to frame.
class Accelerations {
 public:
  Accelerations(const mesh::Animation& animation, const std::vector<std::vector<Part>>& parts)
      : animation_(animation),
        parts_(parts),
        has_velocities_(std::all_of(animation.frames.begin(), animation.frames.end(),
                                    [](const mesh::TriangleMesh& frame) {
                                      return frame.velocities.cols() == frame.vertices.cols();
                                    })) {}

  // m/s^2
  std::vector<Eigen::Vector3d> All() {
    std::vector<PartStep> before, now;
    for (int k = 0; k + 1 < animation_.num_frames(); ++k) {
      now.clear();
      for (const Part& part : parts_[k]) {
        const PartStep* const last = StepTo(part, before);
        const PartStep step{&part, NextOf(part, Expected(part, last, k), parts_[k + 1])};
        if (step.to == nullptr) continue;
        now.push_back(step);
        if (last != nullptr) Add(*last, step, k);
      }
      std::swap(before, now);
    }
    return std::move(found_);
  }

 private:
  double Seconds(int k) const {
    return (animation_.time(k + 1) - animation_.time(k)) / animation_.frames_per_second;
  }
  static const PartStep* StepTo(const Part& part, const std::vector<PartStep>& steps) {
    const auto found = std::find_if(steps.begin(), steps.end(),
                                    [&](const PartStep& step) { return step.to == &part; });
    return found == steps.end() ? nullptr : &*found;
  }
  Eigen::Vector3d Expected(const Part& part, const PartStep* last, int k) const {
    if (has_velocities_) return part.centre + Seconds(k) * part.velocity;
    if (last == nullptr) return part.centre;
    return part.centre + (part.centre - last->from->centre) * (Seconds(k) / Seconds(k - 1));
  }
  void Add(const PartStep& last, const PartStep& step, int k) {
    if (has_velocities_) {
      found_.push_back((step.to->velocity - last.from->velocity) / (Seconds(k - 1) + Seconds(k)));
      return;
    }
    const Eigen::Vector3d before = (last.to->centre - last.from->centre) / Seconds(k - 1);
    const Eigen::Vector3d after = (step.to->centre - step.from->centre) / Seconds(k);
    found_.push_back(2 * (after - before) / (Seconds(k - 1) + Seconds(k)));
  }

  const mesh::Animation& animation_;
  const std::vector<std::vector<Part>>& parts_;
  const bool has_velocities_;
  std::vector<Eigen::Vector3d> found_;
};

// Median of each coordinate. Requires: not empty.
Eigen::Vector3d MedianOf(const std::vector<Eigen::Vector3d>& vectors) {
  Eigen::Vector3d median;
  std::vector<double> values(vectors.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(vectors.begin(), vectors.end(), values.begin(),
                   [&](const Eigen::Vector3d& vector) { return vector[axis]; });
    const auto middle = values.begin() + static_cast<int64_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    median[axis] = *middle;
  }
  return median;
}

bool IsClear(const Eigen::Vector3d& median, const std::vector<Eigen::Vector3d>& accelerations,
             const mesh::Animation& animation) {
  const double frame_s = 1 / animation.frames_per_second;
  const double bend_m = median.norm() * frame_s * frame_s;
  if (!(bend_m > kMinBendEdges * mesh::MeanEdgeLength(animation))) return false;
  if (median.cwiseAbs().maxCoeff() < kMinCosine * median.norm()) return false;
  const auto num_near = std::count_if(
      accelerations.begin(), accelerations.end(), [&](const Eigen::Vector3d& acceleration) {
        return (acceleration - median).norm() <= kNearMedian * median.norm();
      });
  return static_cast<double>(num_near) >= kShareNear * static_cast<double>(accelerations.size());
}

// The axis against which most of the acceleration goes.
mesh::Up UpAgainst(const Eigen::Vector3d& acceleration) {
  Eigen::Index axis = 0;
  acceleration.cwiseAbs().maxCoeff(&axis);
  const int first = static_cast<int>(acceleration[axis] < 0 ? mesh::Up::kX : mesh::Up::kMinusX);
  return static_cast<mesh::Up>(first + static_cast<int>(axis));
}

}  // namespace

FoundUp FindUp(const mesh::Animation& animation, const parallel::Arena& arena) {
  std::vector<std::vector<Part>> parts(animation.frames.size());
  arena.Run(animation.num_frames(),
            [&](int64_t k) { parts[k] = DetachedParts(animation.frames[k]); });
  const std::vector<Eigen::Vector3d> accelerations = Accelerations(animation, parts).All();
  FoundUp found;
  found.num_samples = static_cast<int>(accelerations.size());
  if (accelerations.size() < kMinSamples) return found;
  const Eigen::Vector3d median = MedianOf(accelerations);
  if (IsClear(median, accelerations, animation)) found.up = UpAgainst(median);
  return found;
}

void SettleUp(mesh::Animation& animation, const parallel::Arena& arena) {
  const FoundUp found = FindUp(animation, arena);
  const bool is_given = animation.up != mesh::Up::kUnknown;
  if (is_given && (found.up == mesh::Up::kUnknown || found.up == animation.up)) return;
  if (found.up == mesh::Up::kUnknown) {
    animation.notes.push_back(
        "Assumed that z is up: no falling part shows it. If that is wrong, import again with `up` "
        "given (--up).");
    return;
  }
  const std::string shown = absl::StrCat("falling parts show that ", mesh::NameOf(found.up),
                                         " is up (", found.num_samples, " accelerations)");
  animation.notes.push_back(
      is_given ? absl::StrCat("Took ", mesh::NameOf(animation.up), " as up, as given, although ",
                              shown, ".")
               : absl::StrCat("Took ", mesh::NameOf(found.up), " as up: ", shown, "."));
  if (!is_given) animation.up = found.up;
}

}  // namespace liquidblend::ingest
