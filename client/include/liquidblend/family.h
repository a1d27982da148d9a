// Families of registered animations, and what a registration is asked for. Times are seconds since
// the first frame.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/bounds.h"
#include "liquidblend/parameter_space.h"
#include "liquidblend/space_time.h"
#include "liquidblend/up.h"

namespace liquidblend {

enum class CorrespondenceKind {
  kPoint,       // one point in space-time
  kTrajectory,  // followed through the velocity field
  kSpace,       // pinned in x, y, z; free in time
};

enum class Grade {
  kUnknown,       // an older program registered the family
  kGood,          // blends are as good as the method makes them
  kDoubtful,      // look at the worst region; correspondences may help
  kTooDifferent,  // blends will not look like either animation
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
  double length_s = 0.0;  // kTrajectory, kSpace: how long; 0: to the end
};

// Outcome of a correspondence.
struct CorrespondenceReport {
  Correspondence correspondence;
  bool kept = true;  // false: soft, and further off than 3 mean edges (a frame counts as one)
  double residual_m = 0.0;  // the largest distance from where it should be, over its nodes
  double residual_frames = 0.0;
  int num_nodes = 0;
  bool automatic = false;   // found by the registration, not given by a user
  double confidence = 1.0;  // of an automatic one, [0, 1]
};

// Whether a registration can be trusted, and whether the two animations were alike enough for it.
struct Verdict {
  Grade grade = Grade::kUnknown;
  std::string reason;  // what decided, with its value and limit
  Event worst;         // where that is worst, on the registered source
  // Figures by the names of the fields of liquidblend.v1.Verdict, which says what they are: all
  // single ones, and all lists. Both are empty if an older program registered the family.
  std::map<std::string, double> figures;
  std::map<std::string, std::vector<double>> lists;
};

// A way to pair the features of both animations that was tried.
struct Hypothesis {
  std::string pairing;  // what guided the registration
  // Loss of its blends: the sum over the verdict's figures of their squares, each over its limit.
  double cost = 0.0;
  bool is_kept = false;
};

struct RegistrationReport {
  std::string target;  // animations/{id}
  int num_nodes = 0;
  int num_iterations = 0;
  double mean_residual_edges = 0.0;  // mean distance to the target, in mean edge lengths
  double inlier_share = 0.0;
  double seconds = 0.0;
  std::vector<CorrespondenceReport>
      correspondences;  // the user's in their order, then automatic ones
  Verdict verdict;
  std::vector<Hypothesis> hypotheses;  // in the order tried; none: there was no choice
};

// How times of matching events blend.
struct TimeBlending {
  enum class Kind {
    kUnspecified,  // kAutomatic; in a refinement, as the family has it
    kLinear,       // as positions do
    kSquares,      // their squares do: right for falls from rest, from different heights
    kAutomatic,    // kSquares if what is detached in the first frames falls from rest, else kLinear
  };
  Kind kind = Kind::kUnspecified;
  double rest_time_s = 0.0;  // kSquares: of times since then; [-3600, 0]
  std::string reason = {};   // of a family: why, if the worker chose; not sent
};

struct LevelOfDetail {
  int64_t num_vertices = 0;  // of the space-time mesh
  int64_t num_cells = 0;
};

// A version of a family that is kept beside the published one.
struct FamilyVersion {
  int64_t version = 0;
  std::string source;
  std::vector<std::string> targets;
  int64_t size_bytes = 0;
  absl::Time publish_time = absl::UnixEpoch();
};

// A registration that ended without a version.
struct FailedRegistration {
  std::string operation;  // operations/{id}
  absl::Status error;     // kCancelled if it was cancelled
  absl::Time end_time = absl::UnixEpoch();
};

// One source animation and its targets, registered.
struct Family {
  std::string name;                  // families/{id}
  int64_t version = 0;               // grows with each registration; 0: none is finished yet
  std::string source;                // animations/{id}
  std::vector<std::string> targets;  // animations/{id}; blend weights are in this order
  double duration_s = 0.0;           // valid times: [0, duration_s]
  double frames_per_second = 0.0;
  Up up = Up::kUnknown;  // the source's
  Bounds bounds;
  int64_t num_vertices = 0;  // of the space-time mesh
  int64_t num_cells = 0;
  std::vector<LevelOfDetail> coarser_levels;  // levels of detail from 1 on
  bool has_velocities = false;  // frames can have the simulation's velocities, not just the slope's
  std::vector<RegistrationReport> reports;  // one per target
  // The source's, then one per target; none if an older program registered the family.
  std::vector<SpaceTimeReport> space_time_reports;
  ParameterSpace parameter_space;
  TimeBlending time_blending;
  int64_t restored_version = 0;  // that this one is again, by Client::RollbackFamily(); 0: none
  std::vector<FamilyVersion> kept_versions;  // newest first; only from Client::GetFamily()
  // The newest registration, if it failed or was cancelled.
  std::optional<FailedRegistration> failed_registration;
  int64_t size_bytes = 0;
  absl::Time create_time = absl::UnixEpoch();
  absl::Time update_time = absl::UnixEpoch();
  std::string json;  // all of that in protobuf's JSON of liquidblend.v1.Family, as HTTP answers it
};

// 0 means: the server's default. Upper ends of ranges are checked by the server.
struct RegistrationOptions {
  int max_iterations = 0;           // >= 0
  double node_spacing_edges = 0.0;  // >= 0; in mean edge lengths
  double sample_share = 0.0;        // [0, 1]
  uint64_t seed = 0;
  double final_smoothness = 0.0;  // >= 0
  double thin_sheets_from = 0.0;  // [0, 1]; share of the iterations before thin sheets take part
  std::optional<bool> automatic_correspondences;  // soft ones of what stands out in both; true

  // Calls visit(name, option) for each option, named as in liquidblend.v1.RegistrationOptions.
  template <typename Self, typename Visit>
  static void ForEach(Self& self, const Visit& visit) {
    visit("max_iterations", self.max_iterations);
    visit("node_spacing_edges", self.node_spacing_edges);
    visit("sample_share", self.sample_share);
    visit("seed", self.seed);
    visit("final_smoothness", self.final_smoothness);
    visit("thin_sheets_from", self.thin_sheets_from);
    visit("automatic_correspondences", self.automatic_correspondences);
  }

  // Errors: kInvalidArgument with the first field that is negative or not finite, and its value.
  absl::Status Validate() const;
};

struct RegisterRequest {
  std::string family;                // the id, with or without "families/"
  std::string source;                // an animation's id, with or without "animations/"
  std::vector<std::string> targets;  // at least one, likewise
  RegistrationOptions options;
  SpaceTimeOptions space_time;                               // of the source and all targets
  std::vector<std::vector<Correspondence>> correspondences;  // none, or one list per target
  ParameterSpace parameter_space;                            // may be empty
  TimeBlending time_blending;
  // Go on from the family's newest version, with these correspondences instead of its own; source,
  // targets and parameter space may be empty, its interpolation unspecified: as they are.
  bool refine = false;
  // Publish a new version, from scratch, of a family that exists already; without this or refine
  // that is kAlreadyExists.
  bool replace = false;
  // Publish only if no target's grade is worse: kGood or kDoubtful; kUnknown: always.
  Grade required_grade = Grade::kUnknown;
  int priority = 0;  // [-100, 100]; larger ones are worked on first
};

}  // namespace liquidblend
