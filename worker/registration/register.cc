#include "worker/registration/register.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "worker/registration/closest_point.h"
#include "worker/registration/deformation.h"
#include "worker/registration/energy.h"
#include "worker/registration/finish.h"
#include "worker/registration/match.h"
#include "worker/registration/pins.h"
#include "worker/registration/rigid_pieces.h"
#include "worker/registration/verdict.h"

namespace liquidblend::registration {
namespace {

constexpr double kAnnealedShare = 0.8;  // of the iterations; the rest stay soft
// Of the samples, in the first iteration: a stiff surface is held by few, and its systems take the
// most steps to solve.
constexpr double kFirstSampleShare = 0.2;
constexpr int kMaxRelaxRounds = 8;
constexpr int kExtrapolationSweeps = 30;

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
  if (std::abs(source.frames_per_second - target.frames_per_second) >
      1e-3 * source.frames_per_second) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the source has ", source.frames_per_second, " frames per second and the target ",
        target.frames_per_second, "; both must have the same"));
  }
  return absl::OkStatus();
}

// From `first` to `last`, geometrically, as f goes from 0 to 1.
double Anneal(double first, double last, double f) { return first * std::pow(last / first, f); }

std::vector<int32_t> VerticesOf(const std::vector<Pin>& pins) {
  std::vector<int32_t> vertices;
  for (const Pin& pin : pins) vertices.push_back(pin.vertex);
  return vertices;
}

// The state of one registration: what each iteration reads and changes.
struct Problem {
  const Surface& source;
  const IndexLists& neighbors;
  const DeformationNodes& nodes;
  const NodeGraph& graph;
  const std::vector<Pin>& pins;
  const RegistrationOptions& options;
  const parallel::Arena& arena;
};

// One step of the loop of Algorithm 1: match, then minimise.
absl::StatusOr<IterationReport> Iterate(const Problem& problem, int iteration, Matcher& matcher,
                                        std::vector<NodeMap>& maps) {
  const RegistrationOptions& options = problem.options;
  const double annealed = kAnnealedShare * (options.max_iterations - 1);
  const double f = annealed > 0 ? std::min(1.0, (iteration - 1) / annealed) : 1.0;
  MatchOptions match_options;
  match_options.sample_share =
      Anneal(kFirstSampleShare * options.sample_share, options.sample_share, f);
  match_options.kept_share = options.kept_share;
  match_options.max_distance =
      Anneal(options.first_distance_edges, options.final_distance_edges, f);
  match_options.point_weight = options.point_weight;
  match_options.plane_weight = options.plane_weight;
  match_options.match_thin = iteration > options.thin_sheets_from * options.max_iterations;
  Matches matches = matcher.Match(problem.nodes, maps, match_options, problem.arena);

  IterationReport report;
  report.iteration = iteration;
  report.num_iterations = options.max_iterations;
  report.num_inliers = static_cast<int64_t>(matches.terms.size());
  report.num_samples = matches.num_samples;
  const bool soft_pins = iteration <= options.soft_release * options.max_iterations;
  for (const Pin& pin : problem.pins) {
    if (pin.hard || soft_pins) {
      matches.terms.push_back(TermOf(pin, options.correspondence_weight));
    }
  }
  SolverOptions solver_options;
  solver_options.smoothness = Anneal(options.first_smoothness, options.final_smoothness, f);
  solver_options.max_direct_rows = options.max_direct_rows;
  const auto solved = Minimize(problem.nodes, problem.graph, problem.source.points, matches.terms,
                               solver_options, problem.arena, maps);
  if (!solved.ok()) {
    return absl::InternalError(
        absl::StrCat("iteration ", iteration, ": ", std::string(solved.status().message())));
  }
  report.fit_energy = solved->fit_energy;
  report.smoothness_energy = solved->smoothness_energy;
  return report;
}

// Registration units -> metres and frames.
Eigen::Matrix4Xf InMetres(Points displacement, double edge_length_m) {
  displacement.topRows<3>() *= static_cast<float>(edge_length_m);
  return displacement;
}

}  // namespace

absl::Status RegistrationOptions::Validate() const {
  constexpr mesh::Range kShare = {0, 1}, kNotNegative = {0, 1e9}, kPositive = {1e-9, 1e9};
  LB_RETURN_IF_ERROR(mesh::CheckRange("max_iterations", max_iterations, mesh::kMaxIterations));
  LB_RETURN_IF_ERROR(
      mesh::CheckRange("node_spacing_edges", node_spacing_edges, mesh::kNodeSpacingEdges));
  LB_RETURN_IF_ERROR(mesh::CheckRange("sample_share", sample_share, mesh::kSampleShare));
  LB_RETURN_IF_ERROR(mesh::CheckRange("kept_share", kept_share, kShare));
  LB_RETURN_IF_ERROR(mesh::CheckRange("first_smoothness", first_smoothness, mesh::kSmoothness));
  LB_RETURN_IF_ERROR(mesh::CheckRange("final_smoothness", final_smoothness, mesh::kSmoothness));
  LB_RETURN_IF_ERROR(mesh::CheckRange("first_distance_edges", first_distance_edges, kPositive));
  LB_RETURN_IF_ERROR(mesh::CheckRange("final_distance_edges", final_distance_edges, kPositive));
  LB_RETURN_IF_ERROR(mesh::CheckRange("point_weight", point_weight, kNotNegative));
  LB_RETURN_IF_ERROR(mesh::CheckRange("plane_weight", plane_weight, kNotNegative));
  LB_RETURN_IF_ERROR(
      mesh::CheckRange("correspondence_weight", correspondence_weight, kNotNegative));
  LB_RETURN_IF_ERROR(mesh::CheckRange("soft_release", soft_release, kShare));
  LB_RETURN_IF_ERROR(mesh::CheckRange("thin_sheets_from", thin_sheets_from, mesh::kThinSheetsFrom));
  return mesh::CheckRange("max_direct_rows", max_direct_rows, kNotNegative);
}

absl::StatusOr<Registration> Register(const mesh::SpaceTimeMesh& source_mesh,
                                      const mesh::SpaceTimeMesh& target_mesh,
                                      const std::vector<Correspondence>& correspondences,
                                      const RegistrationOptions& options,
                                      const parallel::Arena& arena,
                                      const ProgressCallback& progress) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_RETURN_IF_ERROR(CheckMeshes(source_mesh, target_mesh));
  const absl::Time start = absl::Now();
  const double edge = source_mesh.edge_length_m;
  const Surface source(source_mesh, edge), target(target_mesh, edge);
  const IndexLists neighbors = VertexNeighbors(source_mesh, source.cells_around, arena);
  LB_ASSIGN_OR_RETURN(const std::vector<Pin> pins,
                      ExpandCorrespondences(correspondences, source, target));
  const DeformationNodes nodes(source.points, neighbors, options.node_spacing_edges,
                               VerticesOf(pins), options.seed, arena, source.rigid);
  const NodeGraph graph(nodes);
  const ClosestPointSearch target_search(target_mesh, target.points, target.cells_around);
  Matcher matcher(source, neighbors, target, target_search, options.seed);
  const Problem problem{source, neighbors, nodes, graph, pins, options, arena};

  std::vector<NodeMap> maps(nodes.num_nodes(), NodeMap::Zero());
  IterationReport last;
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    LB_ASSIGN_OR_RETURN(last, Iterate(problem, iteration, matcher, maps));
    if (progress && !progress(last)) {
      return absl::CancelledError(absl::StrCat("cancelled after iteration ", iteration));
    }
  }
  Points displacement = Deform(nodes, maps, source.points, arena) - source.points;
  Registration result;
  result.report.mean_residual_edges =
      ProjectOntoTarget(nodes, maps, source, neighbors, target_search, {}, arena, displacement);
  RelaxFolds(source, neighbors, kMaxRelaxRounds, arena, displacement);
  CarryRigidPieces(source, arena, displacement);
  Points smooth = Smooth(displacement, neighbors, kExtrapolationSweeps, arena);
  CarryRigidPieces(source, arena, smooth);
  result.displacement = InMetres(displacement, edge);
  result.extrapolation = InMetres(smooth, edge);
  result.report.num_nodes = static_cast<int>(nodes.num_nodes());
  result.report.num_iterations = last.iteration;
  result.report.inlier_share = static_cast<double>(last.num_inliers) /
                               static_cast<double>(std::max<int64_t>(1, last.num_samples));
  result.report.verdict = Judge(source, neighbors, target, target_search, displacement, arena);
  result.report.verdict.fit_energy = last.fit_energy;
  result.report.verdict.smoothness_energy = last.smoothness_energy;
  result.report.seconds = absl::ToDoubleSeconds(absl::Now() - start);
  return result;
}

}  // namespace liquidblend::registration
