#include "worker/registration/compete.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "worker/registration/complete.h"
#include "worker/registration/features/automatic.h"
#include "worker/registration/features/pair_features.h"
#include "worker/registration/finish/verdict.h"
#include "worker/registration/register.h"

namespace liquidblend::registration {
namespace {

constexpr double kMuchLess = 0.5;  // of the cost of the first pairing
// Cost from which other pairings are tried. Below, one figure is beyond its limit and no more.
constexpr double kMinCost = 2.5;
constexpr int kMinIterations = 8;  // fewer make no good registration, whatever the pairing

constexpr std::array<Pairing, 3> kAllPairings = {Pairing::kFound, Pairing::kExchanged,
                                                 Pairing::kNone};

const char* Describe(Pairing pairing) {
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

bool AreSame(const std::vector<AssignedPair>& a, const std::vector<AssignedPair>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const AssignedPair& left, const AssignedPair& right) {
                      return left.row == right.row && left.column == right.column;
                    });
}

// The ways to pair the features of both that differ from options.pairing.
std::vector<Pairing> OtherPairings(const mesh::SpaceTimeMesh& source,
                                   const mesh::SpaceTimeMesh& target,
                                   const RegistrationOptions& options,
                                   const parallel::Arena& arena) {
  const SurfacePair pair(source, target, arena);
  const FeaturesOfPair features =
      FindFeatures(pair.source, pair.target, {.min_diameter = options.smallest_part_edges}, arena);
  const SceneScale scale = ScaleOf(pair.source, pair.target);
  const FeaturePairs found = PairFeatures(features.source, features.target, scale);
  const FeaturePairs exchanged =
      PairFeatures(features.source, features.target, scale, {.exchange = true});
  const bool has_pairs = !found.tracks.empty() || !found.extrema.empty() ||
                         !found.obstacles.empty() || !found.joined.source.empty() ||
                         std::any_of(found.joined.target.begin(), found.joined.target.end(),
                                     [](const JoinedTrack& t) { return t.pre_roll_track >= 0; });
  if (!has_pairs) return {};
  std::vector<Pairing> others;
  for (const Pairing pairing : kAllPairings) {
    if (pairing == options.pairing) continue;
    if (pairing == Pairing::kExchanged && AreSame(found.tracks, exchanged.tracks)) continue;
    others.push_back(pairing);
  }
  return others;
}

// What was tried, and the registration to keep of it.
class Candidates {
 public:
  void Add(Pairing pairing, Registration registration) {
    costs_.push_back(CostOf(registration.report.verdict));
    tried_.push_back({Describe(pairing), costs_.back(), false});
    if (WinnerOf(costs_) + 1 == costs_.size()) best_ = std::move(registration);
  }
  Registration Best() && {
    tried_[WinnerOf(costs_)].is_kept = true;
    if (tried_.size() > 1) best_.report.hypotheses = std::move(tried_);
    return std::move(best_);
  }

 private:
  std::vector<double> costs_;
  std::vector<mesh::Hypothesis> tried_;
  Registration best_;
};

}  // namespace

size_t WinnerOf(const std::vector<double>& costs) {
  const auto least = std::min_element(costs.begin(), costs.end());
  return *least < kMuchLess * costs[0] ? static_cast<size_t>(least - costs.begin()) : 0;
}

Pairing KeptPairing(const std::vector<mesh::Hypothesis>& hypotheses, Pairing tried_first) {
  for (const mesh::Hypothesis& tried : hypotheses) {
    if (!tried.is_kept) continue;
    for (const Pairing pairing : kAllPairings) {
      if (tried.pairing == Describe(pairing)) return pairing;
    }
  }
  return tried_first;
}

absl::StatusOr<Registration> RegisterWithBestPairing(const mesh::SpaceTimeMesh& source,
                                                     const mesh::SpaceTimeMesh& target,
                                                     const std::vector<Correspondence>& users,
                                                     const RegistrationOptions& options,
                                                     const parallel::Arena& arena,
                                                     const RegistrationHooks& hooks) {
  LB_ASSIGN_OR_RETURN(Registration first, Register(source, target, users, options, arena, hooks));
  const bool may_compete =
      options.IsGuidedBy(Pairing::kFound) && first.report.num_iterations >= kMinIterations;
  const mesh::Verdict& verdict = first.report.verdict;
  if (!may_compete || verdict.grade == mesh::Grade::kGood || CostOf(verdict) < kMinCost) {
    return first;
  }
  Candidates candidates;
  candidates.Add(options.pairing, std::move(first));
  for (const Pairing pairing : OtherPairings(source, target, options, arena)) {
    RegistrationOptions other = options;
    other.pairing = pairing;
    auto tried = Register(source, target, users, other, arena, {.progress = hooks.progress});
    if (absl::IsCancelled(tried.status())) return tried;
    if (tried.ok()) {
      candidates.Add(pairing, *std::move(tried));
    } else {
      base::LogWarning(absl::StrCat("a pairing cannot be registered (", Describe(pairing),
                                    "): ", tried.status().ToString()));
    }
  }
  return std::move(candidates).Best();
}

}  // namespace liquidblend::registration
