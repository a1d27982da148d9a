#include "worker/registration/register.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/memory.h"
#include "core/base/status_macros.h"
#include "worker/registration/complete.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/features/container_edges.h"
#include "worker/registration/features/rest.h"
#include "worker/registration/fit/deformation.h"
#include "worker/registration/fit/energy.h"
#include "worker/registration/fit/hard_pins.h"
#include "worker/registration/fit/initialise.h"
#include "worker/registration/fit/match.h"
#include "worker/registration/fit/pins.h"
#include "worker/registration/fit/refine.h"
#include "worker/registration/fit/resume.h"

namespace liquidblend::registration {
namespace {

constexpr double kAnnealedShare = 0.8;  // of the iterations; the rest stay soft
// Share of the samples in the first iteration: few suffice for a stiff surface, and its systems
// take the most steps to solve.
constexpr double kFirstSampleShare = 0.2;
constexpr int kInitialPasses = 100;  // of the diffusion of correspondences
// A refinement: how far along the annealing it begins, far from changed correspondences and next to
// them, how many node spacings they reach, and the diffusion's passes.
constexpr double kRefineFrom = 0.6;
constexpr double kRefineFromNear = 0.3;
constexpr double kRefineReach = 6.0;
constexpr int kRefinePasses = 10;

// Value of the annealing at f: from `first` to `last`, geometrically, as f goes from 0 to 1.
double Anneal(double first, double last, double f) { return first * std::pow(last / first, f); }

std::vector<int32_t> VerticesOf(const std::vector<Pin>& pins) {
  std::vector<int32_t> vertices;
  for (const Pin& pin : pins) vertices.push_back(pin.vertex);
  return vertices;
}

// Schedule of the annealing: f from `from` to 1, next to the pins in `near` from `from_near` on.
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
  const double ratio = options.SmoothnessFactor(options.first_smoothness, f_near - f);
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
  match_options.drawn_share =
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
  report.num_inliers = matches.num_matched;
  report.num_samples = matches.num_samples;
  if (iteration <= options.soft_release * schedule.num_iterations) {
    OverrideClosestPoints(problem.pins, options.correspondence_weight, problem.nodes.num_nodes(),
                          matches.terms);
  }
  SolverOptions solver_options;
  solver_options.smoothness =
      options.first_smoothness * options.SmoothnessFactor(options.first_smoothness, f);
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

// Runs all iterations, or those after the state to resume from. Returns the last one's report.
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

// Joins correspondences: the user's, then the automatic ones.
std::vector<Correspondence> Join(const std::vector<Correspondence>& users,
                                 const std::vector<AutomaticCorrespondence>& found) {
  std::vector<Correspondence> all = users;
  for (const AutomaticCorrespondence& automatic : found) all.push_back(automatic.correspondence);
  return all;
}

// Correspondences that guide the fit.
struct Guidance {
  std::vector<Correspondence> correspondences;  // the user's, then those found
  std::vector<AutomaticCorrespondence> found;
  std::vector<Pin> pins;  // of all of them
  mesh::RestReport rest;
};

// Finds automatic correspondences, edges of the container, part motions, open starts and falls from
// rest, and expands correspondences into pins. Errors: those of ExpandCorrespondences() and
// CheckContradictions().
absl::StatusOr<Guidance> FindGuidance(const std::vector<Correspondence>& users,
                                      const RegistrationOptions& options,
                                      const parallel::Arena& arena, SurfacePair& pair) {
  const Surface &source = pair.source, &target = pair.target;
  const double edge = source.mesh.edge_length_m;
  const FeaturesOfPair features =
      FindFeatures(source, target, {.min_diameter = options.smallest_part_edges}, arena);
  pair.MarkUnmatchedStarts(features.source, features.target);
  Guidance guidance;
  const FeaturePairs pairs = PairFeatures(features.source, features.target, ScaleOf(source, target),
                                          {.exchange = options.pairing == Pairing::kExchanged});
  guidance.rest = FindRest(features.source, features.target, pairs.joined);
  pair.parts = PartsOfBoth(features.source, features.target, pairs.tracks);
  pair.times = TimesBlendOf(guidance.rest);
  if (options.IsGuidedBy(Pairing::kFound)) {
    pair.source.held = FindContainerEdges(source, target, users, edge);
  }
  if (options.IsGuidedBy(options.pairing)) {
    guidance.found = FindAutomatic(source, target, features, pairs, users, edge, arena);
    pair.FindPartMotions(features.source, features.target, pairs, users);
  }
  pair.HidePreRoll(features.source, features.target, pairs);
  guidance.correspondences = Join(users, guidance.found);
  LB_ASSIGN_OR_RETURN(guidance.pins,
                      ExpandCorrespondences(guidance.correspondences, source, target, arena));
  LB_RETURN_IF_ERROR(CheckContradictions(guidance.pins, source.points, edge));
  return guidance;
}

// The deformation nodes and their maps, from the first iteration to the last. The arguments must
// outlive it.
class Fitting {
 public:
  Fitting(const SurfacePair& pair, const Guidance& guidance, const RegistrationOptions& options,
          const parallel::Arena& arena)
      : pair_(pair),
        guidance_(guidance),
        options_(options),
        arena_(arena),
        nodes_(std::in_place, pair.source.points, pair.neighbors, options.NodeSpacing(),
               VerticesOf(guidance.pins), options.seed, arena, pair.source.rigid),
        num_nodes_(static_cast<int>(nodes_->num_nodes())),
        graph_(*nodes_),
        hard_pins_(*nodes_, pair.source.points, guidance.pins),
        maps_(nodes_->num_nodes(), NodeMap::Zero()) {}

  // Sets the maps before the first iteration.  previous: null: from zero
  absl::Status Begin(const PreviousRegistration* previous) {
    schedule_.num_iterations = options_.max_iterations;
    if (previous != nullptr) {
      LB_RETURN_IF_ERROR(BeginRefinement(*previous));
    }
    DiffusePins(*nodes_, graph_, pair_.source, guidance_.pins,
                previous != nullptr ? kRefinePasses : kInitialPasses, arena_, maps_);
    return absl::OkStatus();
  }

  // Runs the iterations. Returns the last one's report.
  absl::StatusOr<IterationReport> Run(const RegistrationHooks& hooks, absl::Time start) {
    Matcher matcher(pair_.source, pair_.neighbors, pair_.target, pair_.target_search, pair_.motions,
                    options_.seed, pair_.target.FreeVertices());
    const Problem problem{pair_.source, pair_.neighbors, *nodes_,  graph_, guidance_.pins,
                          hard_pins_,   schedule_,       options_, arena_, start};
    return IterateAll(problem, hooks, matcher, maps_);
  }

  // Returns the displacement, in edges and frames. Frees the nodes unless HoldPins() needs them:
  // they are large.
  Points TakeDisplacement() {
    const Points& rest = pair_.source.points;
    Points displacement = Deform(*nodes_, maps_, rest, arena_) - rest;
    if (hard_pins_.empty()) nodes_.reset();
    return displacement;
  }

  // Moves hard correspondences back to their goals.
  absl::Status HoldPins(Points& moved) const {
    return hard_pins_.empty() ? absl::OkStatus() : hard_pins_.Restore(*nodes_, arena_, moved);
  }

  int num_nodes() const { return num_nodes_; }

 private:
  // Sets the maps that a refinement starts from, and the rest of the annealing.
  absl::Status BeginRefinement(const PreviousRegistration& previous) {
    const Surface& source = pair_.source;
    const double spacing = options_.NodeSpacing();
    maps_ = FitMaps(*nodes_, source.points, pair_.neighbors,
                    InEdgeUnits(previous.displacement, source.mesh.edge_length_m), spacing, arena_);
    LB_ASSIGN_OR_RETURN(const std::vector<Pin> changed,
                        ChangedPins(previous.correspondences, guidance_.correspondences, source,
                                    pair_.target, arena_));
    schedule_ = {options_.refine_iterations, kRefineFrom, kRefineFromNear,
                 ClosenessToPins(*nodes_, source.points, changed, kRefineReach * spacing)};
    return absl::OkStatus();
  }

  const SurfacePair& pair_;
  const Guidance& guidance_;
  const RegistrationOptions& options_;
  const parallel::Arena& arena_;
  std::optional<const DeformationNodes> nodes_;
  int num_nodes_;
  NodeGraph graph_;
  HardPins hard_pins_;
  std::vector<NodeMap> maps_;
  Schedule schedule_ = {};
};

// Reports each correspondence, the automatic ones last.
std::vector<CorrespondenceReport> ReportGuidance(const Guidance& guidance,
                                                 const Eigen::Matrix4Xf& displacement,
                                                 double edge_length_m) {
  std::vector<CorrespondenceReport> reports =
      ReportCorrespondences(guidance.correspondences, guidance.pins,
                            InEdgeUnits(displacement, edge_length_m), edge_length_m);
  const size_t num_users = reports.size() - guidance.found.size();
  for (size_t n = 0; n < guidance.found.size(); ++n) {
    reports[num_users + n].automatic = true;
    reports[num_users + n].confidence = guidance.found[n].confidence;
  }
  return reports;
}

void ReportIterations(const IterationReport& last, mesh::RegistrationReport& report) {
  report.num_iterations = last.iteration;
  report.inlier_share = static_cast<double>(last.num_inliers) /
                        static_cast<double>(std::max<int64_t>(1, last.num_samples));
  report.verdict.fit_energy = last.fit_energy;
  report.verdict.smoothness_energy = last.smoothness_energy;
}

// Registers or refines.
//   previous  registration to refine; null: none
absl::StatusOr<Registration> Run(const mesh::SpaceTimeMesh& source,
                                 const mesh::SpaceTimeMesh& target,
                                 const std::vector<Correspondence>& users,
                                 const PreviousRegistration* previous,
                                 const RegistrationOptions& options, const parallel::Arena& arena,
                                 const RegistrationHooks& hooks) {
  LB_RETURN_IF_ERROR(options.Validate());
  LB_RETURN_IF_ERROR(CheckMeshes(source, target));
  const absl::Time start = StartOf(hooks.resume);
  SurfacePair pair(source, target, arena);
  LB_ASSIGN_OR_RETURN(const Guidance guidance, FindGuidance(users, options, arena, pair));
  Fitting fitting(pair, guidance, options, arena);
  LB_RETURN_IF_ERROR(fitting.Begin(previous));
  base::ReturnFreeMemory();  // of the searches
  LB_ASSIGN_OR_RETURN(const IterationReport last, fitting.Run(hooks, start));
  const auto hold_pins = [&](Points& moved) { return fitting.HoldPins(moved); };
  LB_ASSIGN_OR_RETURN(Registration result,
                      Complete(pair, fitting.TakeDisplacement(), Detail::kAll, hold_pins, arena));
  result.report.correspondences =
      ReportGuidance(guidance, result.displacement, source.edge_length_m);
  result.report.rest = guidance.rest;
  result.report.num_nodes = fitting.num_nodes();
  ReportIterations(last, result.report);
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
