// The first and the last stage of every registration. Internal to worker/registration.
#pragma once

#include <functional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "worker/registration/features/part_motions.h"
#include "worker/registration/features/starts.h"
#include "worker/registration/finish/blended_parts.h"
#include "worker/registration/registration.h"
#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Checks that both meshes have cells, normals and vertices that are not of droplets, and the same
// frame rate.  Errors: kInvalidArgument as Register().
absl::Status CheckMeshes(const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target);

// Source and target in the source's mean edge lengths, with search structures. The meshes must
// outlive it.
struct SurfacePair {
  // Builds the surfaces of both meshes, and the search structures.
  SurfacePair(const mesh::SpaceTimeMesh& source_mesh, const mesh::SpaceTimeMesh& target_mesh,
              const parallel::Arena& arena);
  SurfacePair(const SurfacePair&) = delete;
  SurfacePair& operator=(const SurfacePair&) = delete;
  // Finds the motions of parts that both meshes have, except those that the users' correspondences
  // contradict.  Requires: `times` is set.
  void FindPartMotions(const Features& source_features, const Features& target_features,
                       const FeaturePairs& pairs, const std::vector<Correspondence>& users) {
    motions = PartMotions(source_features, target_features, pairs, users, source.mesh.edge_length_m,
                          times);
  }
  // Finds the parts of the source's pre-roll that have no motion to one of the target. Their tracks
  // in the target, if there are any, are open starts.  Requires: motions and open starts were
  // found.
  void HidePreRoll(const Features& source_features, const Features& target_features,
                   const FeaturePairs& pairs);
  // Finds the starts of parts that only one of the two meshes has, and marks their vertices.
  void MarkUnmatchedStarts(const Features& source_features, const Features& target_features);

  Surface source;
  Surface target;
  PackedLists neighbors;  // of the source's vertices
  ClosestPointSearch target_search;
  OpenStarts open_starts;
  PartMotions motions;
  std::vector<Part> hidden_parts;  // of the source's pre-roll, not to be shown in any blend
  std::vector<PartOfBoth> parts;   // that the verdict looks at
  TimesBlend times = TimesBlend::kLinearly;
};

// Share of the vertices that the first projection onto the target measures; the others follow.
enum class Detail { kAll, kHalf };

// Turns the fitted displacement into the result: projects it onto the target, mends folds, carries
// droplets, extrapolates and judges. The report's figures of the iterations are not set.
//   displacement  in edges and frames
//   hold_pins     moves hard correspondences back to their goals
// Errors: those of hold_pins.
absl::StatusOr<Registration> Complete(const SurfacePair& pair, Points displacement, Detail detail,
                                      const std::function<absl::Status(Points&)>& hold_pins,
                                      const parallel::Arena& arena);

}  // namespace liquidblend::registration
