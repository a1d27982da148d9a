// Families of registered animations, and what a registration is asked for. Times are seconds since
// the first frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/bounds.h"
#include "liquidblend/space_time.h"

namespace liquidblend {

struct RegistrationReport {
  std::string target;  // animations/{id}
  int num_nodes = 0;
  int num_iterations = 0;
  double mean_residual_edges = 0.0;  // mean distance to the target, in mean edge lengths
  double inlier_share = 0.0;
  double seconds = 0.0;
};

struct LevelOfDetail {
  int64_t num_vertices = 0;  // of the space-time mesh
  int64_t num_cells = 0;
};

// One source animation and its targets, registered.
struct Family {
  std::string name;                  // families/{id}
  int64_t version = 0;               // grows with each registration; 0: none is finished yet
  std::string source;                // animations/{id}
  std::vector<std::string> targets;  // animations/{id}; blend weights are in this order
  double duration_s = 0.0;           // valid times: [0, duration_s]
  double frames_per_second = 0.0;
  Bounds bounds;
  int64_t num_vertices = 0;  // of the space-time mesh
  int64_t num_cells = 0;
  std::vector<LevelOfDetail> coarser_levels;  // levels of detail from 1 on
  bool has_velocities = false;  // frames can have the simulation's velocities, not just the slope's
  std::vector<RegistrationReport> reports;  // one per target
  // The source's, then one per target; none if an older program registered the family.
  std::vector<SpaceTimeReport> space_time_reports;
  int64_t size_bytes = 0;
  absl::Time create_time = absl::UnixEpoch();
  absl::Time update_time = absl::UnixEpoch();
};

// 0 means: the server's default.
struct RegistrationOptions {
  int max_iterations = 0;           // >= 0
  double node_spacing_edges = 0.0;  // >= 0; in mean edge lengths
  double sample_share = 0.0;        // [0, 1]
  uint64_t seed = 0;
  double final_smoothness = 0.0;  // >= 0
  double thin_sheets_from = 0.0;  // [0, 1]; share of the iterations before thin sheets take part
  absl::Status Validate() const;  // names the first field out of range, and its value
};

enum class CorrespondenceKind {
  kPoint,       // one point in space-time
  kTrajectory,  // followed through the velocity field
  kSpace,       // pinned in x, y, z; free in time
};

struct Event {
  Vector3 position;
  double time_s = 0.0;
};

// A pair that must (hard) or should (soft) fall on each other.
struct Correspondence {
  CorrespondenceKind kind = CorrespondenceKind::kPoint;
  bool hard = false;
  Event source;
  Event target;
  double length_s = 0.0;  // kTrajectory: how long; 0: to the end
};

struct RegisterRequest {
  std::string family;                // the id, with or without "families/"
  std::string source;                // an animation's id, with or without "animations/"
  std::vector<std::string> targets;  // at least one, likewise
  RegistrationOptions options;
  SpaceTimeOptions space_time;                               // of the source and all targets
  std::vector<std::vector<Correspondence>> correspondences;  // none, or one list per target
};

}  // namespace liquidblend
