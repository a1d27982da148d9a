// Samples of one iteration and their closest points, as fitting terms (paper, sections 5.2, 6.1 and
// 6.2). Internal to worker/registration.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/mesh/space_time_mesh.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/state.h"
#include "worker/registration/surface/cell_graph.h"
#include "worker/registration/surface/closest_point.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

struct MatchOptions {
  double drawn_share = 0.1;    // (0, 1]; of the source's vertices
  double kept_share = 0.2;     // [0, 1]; of the samples: the worst of the call before
  double target_share = 1.0;   // >= 0; samples of the target per sample of the source
  double max_distance = 15.0;  // > 0; matches this far apart have weight 0
  double point_weight = 0.1;   // gamma_point
  double plane_weight = 1.0;   // gamma_plane
  bool match_thin = true;      // thin sheets take part
};

struct Matches {
  std::vector<FitTerm> terms;
  int64_t num_samples = 0;
  int64_t num_matched = 0;  // of the samples; the others have no compatible point
};

// For a vertex of an open start of the source: whether it has moved before the target's first
// frame, where the target is unknown, or belongs to the first slab, which has no constraint.
bool IsBeforeTarget(const Surface& source, int64_t v, const Eigen::Vector4f& moved);

// Whether source vertex v, of an open start, and target vertex t must not be matched, because the
// target's surface only begins there.
bool IsOpenMatch(const Surface& source, const Surface& target, int64_t v, int64_t t);

// Image of a normal: sign(det J) J^-T N, normalised, J the blend's Jacobian at vertex v.
Eigen::Vector4f DeformedNormal(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                               const Surface& source, int64_t v);

// Metric of a match with unit normal N; at the ends of time only space counts.
Eigen::Matrix4f MatchMetric(double weight, const Eigen::Vector4f& normal,
                            const MatchOptions& options);

class PartMotions;

// Draws the samples of each iteration, and matches them.
class Matcher {
 public:
  // The arguments must outlive the matcher.
  //   motions  of parts of both surfaces
  //   target_vertices  to draw samples from
  Matcher(const Surface& source, const PackedLists& source_neighbors, const Surface& target,
          const ClosestPointSearch& target_search, const PartMotions& motions, uint64_t seed,
          std::vector<int32_t> target_vertices);

  // Matches source samples to the target, and target samples to the deformed source, so that thin
  // parts of the target are not missed. Vertices of the end slabs match the target's end slab in
  // space and are held in time. Samples at edges of the container are also held across these.
  // Threads: one call at a time; same bytes for any thread count.
  Matches Match(const DeformationNodes& nodes, const std::vector<NodeMap>& maps,
                const MatchOptions& options, const parallel::Arena& arena);

  // State that the next call depends on: how many samples each call has drawn, and the source
  // samples of the last one, the furthest first.
  const std::vector<SampleDraw>& draws() const { return draws_; }
  const std::vector<int32_t>& worst() const { return worst_; }

  // Restores the state of draws() and worst(). Requires: Match() has not been called.
  // Errors: kFailedPrecondition if they are of other surfaces; then it cannot be used any more.
  absl::Status Resume(const std::vector<SampleDraw>& draws, const std::vector<int32_t>& worst);

 private:
  struct DeformedState;
  struct DeformedTrees;

  std::vector<int32_t> DrawSource(const MatchOptions& options);
  std::vector<int32_t> DrawTarget(const MatchOptions& options);
  void MatchSource(const DeformedState& state, const std::vector<int32_t>& samples,
                   const MatchOptions& options, const parallel::Arena& arena, Matches& matches);
  void MatchTarget(const DeformedState& state, const DeformedTrees& trees,
                   const std::vector<int32_t>& samples, const MatchOptions& options,
                   const parallel::Arena& arena, Matches& matches) const;

  const Surface& source_;
  const PackedLists& source_neighbors_;
  const Surface& target_;
  const ClosestPointSearch& target_search_;
  const PartMotions& motions_;
  Random random_;
  std::vector<int32_t> source_order_;  // shuffled further by each call
  std::vector<int32_t> target_order_;
  std::vector<SampleDraw> draws_;  // per call
  std::vector<int32_t> worst_;     // source vertices of the call before with the largest distances
};

}  // namespace liquidblend::registration
