#include "worker/registration/register.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/memory.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "worker/registration/automatic.h"
#include "worker/registration/complete.h"
#include "worker/registration/deformation.h"
#include "worker/registration/energy.h"
#include "worker/registration/hard_pins.h"
#include "worker/registration/initialise.h"
#include "worker/registration/match.h"
#include "worker/registration/pins.h"
#include "worker/registration/refine.h"
#include "worker/registration/resume.h"

namespace liquidblend::registration {
namespace {

constexpr double kAnnealedShare = 0.8;  // of the iterations; the rest stay soft
// Of the samples, in the first iteration: a stiff surface is held by few, and its systems take the
// most steps to solve.
constexpr double kFirstSampleShare = 0.2;
constexpr int kInitialPasses = 100;  // of the diffusion of correspondences
// A refinement: how far along the annealing it begins, far from changed correspondences and next to
// them, how many node spacings they reach, and the diffusion's passes.
constexpr double kRefineFrom = 0.6;
constexpr double kRefineFromNear = 0.3;
constexpr double kRefineReach = 6.0;
constexpr int kRefinePasses = 10;

// From `first` to `last`, geometrically, as f goes from 0 to 1.
double Anneal(double first, double last, double f) { return first * std::pow(last / first, f); }

std::vector<int32_t> VerticesOf(const std::vector<Pin>& pins) {
  std::vector<int32_t> vertices;
  for (const Pin& pin : pins) vertices.push_back(pin.vertex);
  return vertices;
}

// How the annealing goes: f from `from` to 1, next to the pins in `near` from `from_near` on.
struct Schedule {
  int num_iterations;
  double from = 0.0;
  double from_near = 0.0;
  std::vector<float> near;  // per node, in [0, 1]; empty: the same everywhere
};

// The state of one registration: what each iteration reads and changes.
struct Problem {
  const Surface& source;
  const PackedLists& neighbors;
  const DeformationNodes& nodes;
  const NodeGraph& graph;
  const std::vector<Pin>& pins;
  const HardPins& hard_pins;
  const Schedule& schedule;
  const RegistrationOptions& options;
  const parallel::Arena& arena;
  absl::Time start;  // of the work, as if it had not been interrupted
};

// The graph with stiffer edges where f is only `f_near`; its weights are relative to those at f.
NodeGraph StiffenNear(const Problem& problem, double f, double f_near) {
  const RegistrationOptions& options = problem.options;
  const double ratio = std::pow(options.final_smoothness / options.first_smoothness, f_near - f);
  std::vector<float> factors;
  for (const float near : problem.schedule.near) {
    factors.push_back(static_cast<float>(std::pow(ratio, near)));
  }
  return problem.graph.Stiffened(factors);
}

// One step of the loop of Algorithm 1: match, then minimise.
absl::StatusOr<IterationReport> Iterate(const Problem& problem, int iteration, Matcher& matcher,
                                        std::vector<NodeMap>& maps) {
  const RegistrationOptions& options = problem.options;
  const Schedule& schedule = problem.schedule;
  const double annealed = kAnnealedShare * (schedule.num_iterations - 1);
  const double done = annealed > 0 ? std::min(1.0, (iteration - 1) / annealed) : 1.0;
  const double f = schedule.from + (1 - schedule.from) * done;
  MatchOptions match_options;
  match_options.sample_share =
      Anneal(kFirstSampleShare * options.sample_share, options.sample_share, f);
  match_options.kept_share = options.kept_share;
  match_options.max_distance =
      Anneal(options.first_distance_edges, options.final_distance_edges, f);
  match_options.point_weight = options.point_weight;
  match_options.plane_weight = options.plane_weight;
  match_options.match_thin = iteration > options.thin_sheets_from * schedule.num_iterations;
  Matches matches = matcher.Match(problem.nodes, maps, match_options, problem.arena);

  IterationReport report;
  report.iteration = iteration;
  report.num_iterations = schedule.num_iterations;
  report.num_inliers = static_cast<int64_t>(matches.terms.size());
  report.num_samples = matches.num_samples;
  if (iteration <= options.soft_release * schedule.num_iterations) {
    OverrideClosestPoints(problem.pins, options.correspondence_weight, problem.nodes.num_nodes(),
                          matches.terms);
  }
  SolverOptions solver_options;
  solver_options.smoothness = Anneal(options.first_smoothness, options.final_smoothness, f);
  solver_options.max_direct_rows = options.max_direct_rows;
  const double f_near = schedule.from_near + (1 - schedule.from_near) * done;
  std::optional<NodeGraph> stiffer;
  if (!schedule.near.empty() && f_near < f) stiffer = StiffenNear(problem, f, f_near);
  const auto solved =
      Minimize(problem.nodes, stiffer ? *stiffer : problem.graph, problem.source.points,
               matches.terms, problem.hard_pins, solver_options, problem.arena, maps);
  if (!solved.ok()) {
    return absl::InternalError(
        absl::StrCat("iteration ", iteration, ": ", std::string(solved.status().message())));
  }
  report.fit_energy = solved->fit_energy;
  report.smoothness_energy = solved->smoothness_energy;
  return report;
}

// All iterations, or those after the state to go on from. Returns the last one's report.
absl::StatusOr<IterationReport> IterateAll(const Problem& problem, const RegistrationHooks& hooks,
                                           Matcher& matcher, std::vector<NodeMap>& maps) {
  IterationReport last;
  const int num_iterations = problem.schedule.num_iterations;
  if (hooks.resume != nullptr) {
    LB_ASSIGN_OR_RETURN(last, Resume(*hooks.resume, num_iterations, matcher, maps));
  }
  for (int iteration = last.iteration + 1; iteration <= num_iterations; ++iteration) {
    LB_ASSIGN_OR_RETURN(last, Iterate(problem, iteration, matcher, maps));
    if (hooks.keep) hooks.keep(StateAfter(last, maps, matcher, problem.start));
    if (hooks.progress && !hooks.progress(last)) {
      return absl::CancelledError(absl::StrCat("cancelled after iteration ", iteration));
    }
  }
  return last;
}

// The maps that a refinement starts from, and the rest of the annealing.
absl::StatusOr<Schedule> BeginRefinement(const PreviousRegistration& previous,
                                         const std::vector<Correspondence>& correspondences,
                                         const Surface& source, const Surface& target,
                                         const PackedLists& neighbors,
                                         const DeformationNodes& nodes,
                                         const RegistrationOptions& options,
                                         const parallel::Arena& arena, std::vector<NodeMap>& maps) {
  const double spacing = options.node_spacing_edges;
  maps = FitMaps(nodes, source.points, neighbors,
                 InEdgeUnits(previous.displacement, source.mesh.edge_length_m), spacing, arena);
  LB_ASSIGN_OR_RETURN(
      const std::vector<Pin> changed,
      ChangedPins(previous.correspondences, correspondences, source, target, arena));
  return Schedule{options.refine_iterations, kRefineFrom, kRefineFromNear,
                  ClosenessToPins(nodes, source.points, changed, kRefineReach * spacing)};
}

// The user's, then those found.
std::vector<Correspondence> Join(const std::vector<Correspondence>& users,
                                 const std::vector<AutomaticCorrespondence>& found) {
  std::vector<Correspondence> all = users;
  for (const AutomaticCorrespondence& automatic : found) all.push_back(automatic.correspondence);
  return all;
}

// Of Join()'s: which of them were found.
void NameOrigins(const std::vector<AutomaticCorrespondence>& found,
                 std::vector<CorrespondenceReport>& reports) {
  const size_t num_users = reports.size() - found.size();
  for (size_t n = 0; n < found.size(); ++n) {
    reports[num_users + n].automatic = true;
    reports[num_users + n].confidence = found[n].confidence;
  }
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
  LB_RETURN_IF_ERROR(
      mesh::CheckRange("refine_iterations", refine_iterations, mesh::kMaxIterations));
  LB_RETURN_IF_ERROR(mesh::CheckRange("thin_sheets_from", thin_sheets_from, mesh::kThinSheetsFrom));
  LB_RETURN_IF_ERROR(mesh::CheckRange("coarse_vertices", coarse_vertices, {1e3, 1e9}));
  LB_RETURN_IF_ERROR(mesh::CheckRange("smallest_part_edges", smallest_part_edges, kNotNegative));
  LB_RETURN_IF_ERROR(mesh::CheckRange("finer_from_edges", finer_from_edges, kPositive));
  return mesh::CheckRange("max_direct_rows", max_direct_rows, kNotNegative);
}

namespace {

//   previous  null: from zero
absl::StatusOr<Registration> Run(const mesh::SpaceTimeMesh& source_mesh,
                                 const mesh::SpaceTimeMesh& target_mesh,
                                 const std::vector<Correspondence>& users,
                                 const PreviousRegistration* previous,
                                 const RegistrationOptions& options, const parallel::Arena& arena,
                                 const RegistrationHooks& hooks) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_RETURN_IF_ERROR(CheckMeshes(source_mesh, target_mesh));
  const absl::Time start = StartOf(hooks.resume);
  const double edge = source_mesh.edge_length_m;
  SurfacePair pair(source_mesh, target_mesh, arena);
  const Surface &source = pair.source, &target = pair.target;
  const PackedLists& neighbors = pair.neighbors;
  const FeaturesOfPair features =
      FindFeatures(source, target, {.min_diameter = options.smallest_part_edges}, arena);
  pair.Open(features.source.tracks, features.target.tracks);
  std::vector<AutomaticCorrespondence> found;
  if (options.automatic_correspondences) {
    const FeaturePairs pairs =
        PairFeatures(features.source, features.target, ScaleOf(source, target));
    found = FindAutomatic(source, target, features, pairs, users, edge, arena);
    pair.FindCourses(features.source, features.target, pairs.tracks, users);
  }
  const std::vector<Correspondence> correspondences = Join(users, found);
  LB_ASSIGN_OR_RETURN(const std::vector<Pin> pins,
                      ExpandCorrespondences(correspondences, source, target, arena));
  LB_RETURN_IF_ERROR(CheckContradictions(pins, source.points, edge));
  std::optional<const DeformationNodes> placed_nodes;
  const DeformationNodes& nodes =
      placed_nodes.emplace(source.points, neighbors, options.node_spacing_edges, VerticesOf(pins),
                           options.seed, arena, source.rigid);
  const NodeGraph graph(nodes);
  Matcher matcher(source, neighbors, target, pair.target_search, pair.courses, options.seed,
                  target.FreeVertices());
  const HardPins hard_pins(nodes, source.points, pins);
  std::vector<NodeMap> maps(nodes.num_nodes(), NodeMap::Zero());
  Schedule schedule{.num_iterations = options.max_iterations, .near = {}};
  if (previous != nullptr) {
    LB_ASSIGN_OR_RETURN(schedule, BeginRefinement(*previous, correspondences, source, target,
                                                  neighbors, nodes, options, arena, maps));
  }
  DiffusePins(nodes, graph, source, pins, previous != nullptr ? kRefinePasses : kInitialPasses,
              arena, maps);
  const Problem problem{source,    neighbors, nodes,   graph, pins,
                        hard_pins, schedule,  options, arena, start};

  base::ReturnFreeMemory();  // of the searches
  LB_ASSIGN_OR_RETURN(const IterationReport last, IterateAll(problem, hooks, matcher, maps));
  const auto hold_pins = [&](Points& moved) {
    return hard_pins.empty() ? absl::OkStatus() : hard_pins.Restore(nodes, arena, moved);
  };
  Points displacement = Deform(nodes, maps, source.points, arena) - source.points;
  const auto num_nodes = static_cast<int>(nodes.num_nodes());
  if (hard_pins.empty()) placed_nodes.reset();  // they are large
  LB_ASSIGN_OR_RETURN(Registration result,
                      Complete(pair, std::move(displacement), Detail::kAll, hold_pins, arena));
  result.report.correspondences =
      ReportCorrespondences(correspondences, pins, InEdgeUnits(result.displacement, edge), edge);
  NameOrigins(found, result.report.correspondences);
  result.report.num_nodes = num_nodes;
  result.report.num_iterations = last.iteration;
  result.report.inlier_share = static_cast<double>(last.num_inliers) /
                               static_cast<double>(std::max<int64_t>(1, last.num_samples));
  result.report.verdict.fit_energy = last.fit_energy;
  result.report.verdict.smoothness_energy = last.smoothness_energy;
  result.report.seconds = absl::ToDoubleSeconds(absl::Now() - start);
  return result;
}

}  // namespace

absl::StatusOr<Registration> Register(const mesh::SpaceTimeMesh& source,
                                      const mesh::SpaceTimeMesh& target,
                                      const std::vector<Correspondence>& correspondences,
                                      const RegistrationOptions& options,
                                      const parallel::Arena& arena,
                                      const RegistrationHooks& hooks) {
  return Run(source, target, correspondences, nullptr, options, arena, hooks);
}

absl::StatusOr<Registration> Refine(const mesh::SpaceTimeMesh& source,
                                    const mesh::SpaceTimeMesh& target,
                                    const std::vector<Correspondence>& correspondences,
                                    const PreviousRegistration& previous,
                                    const RegistrationOptions& options,
                                    const parallel::Arena& arena, const RegistrationHooks& hooks) {
  if (previous.displacement.cols() != source.num_vertices()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the displacement to go on from is of ", previous.displacement.cols(),
                     " vertices, but the source has ", source.num_vertices()));
  }
  if (!previous.displacement.allFinite()) {
    return absl::InvalidArgumentError("the displacement to go on from is not finite");
  }
  return Run(source, target, correspondences, &previous, options, arena, hooks);
}

}  // namespace liquidblend::registration
