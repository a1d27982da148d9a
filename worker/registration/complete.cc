#include "worker/registration/complete.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "worker/registration/finish/extrapolation.h"
#include "worker/registration/finish/finish.h"
#include "worker/registration/finish/folds.h"
#include "worker/registration/finish/part_slip.h"
#include "worker/registration/finish/part_volumes.h"
#include "worker/registration/finish/rigid_pieces.h"
#include "worker/registration/finish/untangle.h"
#include "worker/registration/finish/verdict.h"

namespace liquidblend::registration {
namespace {

constexpr double kAroundPart = 1.5;  // radii
constexpr float kRelaxedWeights[] = {0.5f, 0.75f};
// Options of the projections onto the target. The last one moves tips and rims back, which
// relaxation has drawn off it.
constexpr ProjectionOptions kFirstProjection;
constexpr ProjectionOptions kLastProjection = {.stiffness = 2.0f, .sweeps = 10};

ProjectionOptions With(Detail detail, ProjectionOptions options) {
  if (detail == Detail::kHalf) options.stride = 2;
  return options;
}

// Keeps what surrounds the hidden parts before the first frame, whatever the weights. Elsewhere the
// pre-roll rests, so that it does not show.
void KeepBeforeStart(const SurfacePair& pair, Points& displacement, Points& extrapolation) {
  const Surface& source = pair.source;
  for (const Part& part : pair.hidden_parts) {
    for (int64_t v = 0; v < displacement.cols(); ++v) {
      if (!source.InPreRoll(v) || source.rigid[v] != 0) continue;
      const Eigen::Vector3d place = source.points.col(v).head<3>().cast<double>();
      if ((place - part.centre.head<3>()).norm() > kAroundPart * part.radius()) continue;
      displacement(3, v) = std::min(displacement(3, v), 0.0f);
      extrapolation(3, v) = 0;
    }
  }
}

// Converts a displacement from registration units to metres and frames.
Eigen::Matrix4Xf InMetres(Points displacement, double edge_length_m) {
  displacement.topRows<3>() *= static_cast<float>(edge_length_m);
  return displacement;
}

}  // namespace

absl::Status CheckMeshes(const mesh::SpaceTimeMesh& source, const mesh::SpaceTimeMesh& target) {
  for (const auto* mesh : {&source, &target}) {
    const char* name = mesh == &source ? "source" : "target";
    if (mesh->num_cells() == 0 || mesh->normals.cols() != mesh->num_vertices()) {
      return absl::InvalidArgumentError(
          absl::StrCat("the ", name, " has ", mesh->num_cells(), " cells and ",
                       mesh->normals.cols(), " normals for ", mesh->num_vertices(), " vertices"));
    }
    const std::vector<char> rigid = mesh::RigidVertices(*mesh);
    if (std::find(rigid.begin(), rigid.end(), 0) == rigid.end()) {
      return absl::InvalidArgumentError(absl::StrCat(
          "the ", name, " has nothing but droplets, which are carried and not registered"));
    }
  }
  if (!mesh::IsSameFrameRate(source.frames_per_second, target.frames_per_second)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the source has ", source.frames_per_second, " frames per second and the target ",
        target.frames_per_second, "; both must have the same"));
  }
  return absl::OkStatus();
}

SurfacePair::SurfacePair(const mesh::SpaceTimeMesh& source_mesh,
                         const mesh::SpaceTimeMesh& target_mesh, const parallel::Arena& arena)
    : source(source_mesh, source_mesh.edge_length_m, arena),
      target(target_mesh, source_mesh.edge_length_m, arena),
      neighbors(VertexNeighbors(source_mesh, source.cells_around, arena)),
      target_search(target_mesh, target.points, target.cells_around, arena) {}

void SurfacePair::MarkUnmatchedStarts(const Features& source_features,
                                      const Features& target_features) {
  open_starts = FindOpenStarts(source_features, target_features, ScaleOf(source, target));
  source.open = VerticesOf(open_starts, source);
}

void SurfacePair::HidePreRoll(const Features& source_features, const Features& target_features,
                              const FeaturePairs& pairs) {
  for (int n = 0; n < static_cast<int>(source_features.tracks.size()); ++n) {
    const Track& track = source_features.tracks[n];
    if (!track.is_pre_roll()) continue;
    const Part& part = track.parts.front();
    const auto& all = motions.all();
    const bool is_shown = std::any_of(all.begin(), all.end(), [&](const PartMotion& motion) {
      return motion.begins_in_pre_roll && motion.source.parts.front().number == part.number;
    });
    if (is_shown) continue;
    hidden_parts.push_back(part);
    for (const JoinedTrack& joined : pairs.joined.target) {
      if (joined.pre_roll_track != n) continue;
      open_starts.target.push_back(target_features.tracks[joined.track]);
    }
  }
}

absl::StatusOr<Registration> Complete(const SurfacePair& pair, Points displacement, Detail detail,
                                      const std::function<absl::Status(Points&)>& hold_pins,
                                      const parallel::Arena& arena) {
  const Surface& source = pair.source;
  const PackedLists& neighbors = pair.neighbors;
  Registration result;
  result.report.mean_residual_edges =
      ProjectOntoTarget(source, neighbors, pair.target, pair.target_search,
                        With(detail, kFirstProjection), arena, displacement);
  LB_RETURN_IF_ERROR(hold_pins(displacement));
  for (const float weight : kRelaxedWeights) {
    RelaxFolds(source, neighbors, weight, arena, displacement);
  }
  ProjectOntoTarget(source, neighbors, pair.target, pair.target_search, kLastProjection, arena,
                    displacement);
  OffsetInvertedLayers(source, neighbors, pair.target_search, arena, displacement);
  RemovePartSlip(source, neighbors, pair.motions, arena, displacement);
  MatchPartVolumes(source, neighbors, pair.target, pair.motions, arena, displacement);
  LB_RETURN_IF_ERROR(hold_pins(displacement));
  CarryRigidPieces(source, arena, displacement);
  Points extrapolation = Extrapolation(source, neighbors, displacement, arena);
  CarryRigidPieces(source, arena, extrapolation);
  Untangle(source, extrapolation, arena, displacement);
  KeepBeforeStart(pair, displacement, extrapolation);
  const Points untangled = displacement;
  LB_RETURN_IF_ERROR(hold_pins(displacement));
  for (int64_t v = 0; v < displacement.cols(); ++v) {  // pins may have moved them
    if (source.rigid[v]) displacement.col(v) = untangled.col(v);
  }
  result.report.verdict = Judge(source, neighbors, pair.target, pair.target_search, displacement,
                                pair.parts, pair.motions, pair.times, arena);
  result.report.part_lives = pair.motions.lives();
  const double edge = source.mesh.edge_length_m;
  result.report.verdict.reason += Describe(pair.open_starts, edge);
  result.displacement = InMetres(std::move(displacement), edge);
  result.extrapolation = InMetres(std::move(extrapolation), edge);
  return result;
}

}  // namespace liquidblend::registration
