#include "worker/registration/compete.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/status_macros.h"
#include "worker/registration/complete.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/features/pair_features.h"
#include "worker/registration/finish/verdict.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {
namespace {

constexpr double kNumVertices = 6e4;  // of a coarse mesh, about
constexpr double kMinScale = 2.0;
constexpr int kNumIterations = 8;
constexpr double kMuchLess = 0.5;  // of the cost of the pairs found

std::string Describe(Pairing pairing) {
  switch (pairing) {
    case Pairing::kFound:
      return "the pairs of features of least cost";
    case Pairing::kExchanged:
      return "two detached parts exchange their partners";
    case Pairing::kNone:
      break;
  }
  return "no pairs of features";
}

// The ways to pair the features of both, those found first.
std::vector<Pairing> PossiblePairings(const mesh::SpaceTimeMesh& source,
                                      const mesh::SpaceTimeMesh& target,
                                      const RegistrationOptions& options,
                                      const parallel::Arena& arena) {
  const SurfacePair pair(source, target, arena);
  const FeaturesOfPair features =
      FindFeatures(pair.source, pair.target, {.min_diameter = options.smallest_part_edges}, arena);
  const SceneScale scale = ScaleOf(pair.source, pair.target);
  const FeaturePairs found = PairFeatures(features.source, features.target, scale);
  std::vector<Pairing> possible = {Pairing::kFound};
  const FeaturePairs exchanged =
      PairFeatures(features.source, features.target, scale, {.exchange = true});
  const auto is_same = [](const AssignedPair& a, const AssignedPair& b) {
    return a.row == b.row && a.column == b.column;
  };
  if (!std::equal(found.tracks.begin(), found.tracks.end(), exchanged.tracks.begin(),
                  exchanged.tracks.end(), is_same)) {
    possible.push_back(Pairing::kExchanged);
  }
  const bool has_pairs = !found.tracks.empty() || !found.extrema.empty() ||
                         !found.obstacles.empty() || !found.joined.source.empty();
  if (has_pairs) possible.push_back(Pairing::kNone);
  return possible;
}

}  // namespace

size_t WinnerOf(const std::vector<double>& costs) {
  const auto least = std::min_element(costs.begin(), costs.end());
  return *least < kMuchLess * costs[0] ? least - costs.begin() : 0;
}

double CompetitionScale(int64_t num_vertices) {
  return std::max(kMinScale, std::sqrt(static_cast<double>(num_vertices) / kNumVertices));
}

absl::StatusOr<Competition> Compete(const mesh::SpaceTimeMesh& source,
                                    const mesh::SpaceTimeMesh& target, double scale,
                                    const std::vector<Correspondence>& users,
                                    const RegistrationOptions& options,
                                    const parallel::Arena& arena) {
  Competition competition;
  if (!options.automatic_correspondences) return competition;
  RegistrationOptions coarse = CoarseOptions(scale, options);
  coarse.max_iterations = std::min(coarse.max_iterations, kNumIterations);
  const std::vector<Pairing> possible = PossiblePairings(source, target, coarse, arena);
  if (possible.size() < 2) return competition;
  std::vector<double> costs;
  for (const Pairing pairing : possible) {
    coarse.pairing = pairing;
    LB_ASSIGN_OR_RETURN(const Registration tried, Register(source, target, users, coarse, arena));
    costs.push_back(CostOf(tried.report.verdict));
    competition.hypotheses.push_back({Describe(pairing), costs.back(), false});
  }
  const size_t winner = WinnerOf(costs);
  competition.winner = possible[winner];
  competition.hypotheses[winner].is_kept = true;
  return competition;
}

}  // namespace liquidblend::registration
