#include "worker/registration/compete.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>

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

struct Inputs {
  const mesh::SpaceTimeMesh& source;
  const mesh::SpaceTimeMesh& target;
  const std::vector<Correspondence>& users;
  const RegistrationOptions& options;
  const parallel::Arena& arena;
  const RegistrationHooks& hooks;
};

// A registration with one pairing, and the state after its last iteration if states are kept.
struct Candidate {
  Registration registration;
  IterationState last;
};

//   resume  the state to go on from; null: from the beginning
//   keep    called with the state after each iteration, if states are kept
absl::StatusOr<Candidate> RegisterWith(const Inputs& inputs, Pairing pairing,
                                       const RegistrationState* resume,
                                       const std::function<void(const IterationState&)>& keep) {
  RegistrationOptions options = inputs.options;
  options.pairing = pairing;
  Candidate candidate;
  RegistrationHooks hooks = {.progress = inputs.hooks.progress, .resume = resume};
  const auto* const begun = resume == nullptr ? nullptr : std::get_if<IterationState>(resume);
  if (begun != nullptr) candidate.last = *begun;
  if (inputs.hooks.keep) {
    hooks.keep = [&](RegistrationState state) {
      candidate.last = std::get<IterationState>(std::move(state));
      keep(candidate.last);
    };
  }
  LB_ASSIGN_OR_RETURN(candidate.registration, Register(inputs.source, inputs.target, inputs.users,
                                                       options, inputs.arena, hooks));
  return candidate;
}

// What was tried, and the registration to keep of it.
class Candidates {
 public:
  Candidates(Pairing pairing, Candidate first) { Add(pairing, std::move(first)); }
  // The best one is not at hand then, only its state.
  explicit Candidates(const CompetitionState& resumed) : state_(resumed) { state_.next.reset(); }

  void Add(Pairing pairing, Candidate candidate) {
    state_.tried.push_back(
        {Describe(pairing), CostOf(candidate.registration.report.verdict), false});
    if (IndexOfBest() + 1 < state_.tried.size()) return;
    best_ = std::move(candidate.registration);
    state_.best = std::move(candidate.last);
  }
  void CountOther() { ++state_.num_others; }

  const CompetitionState& state() const { return state_; }
  CompetitionState StateWithin(const IterationState& next) const {
    CompetitionState state = state_;
    state.next = next;
    return state;
  }

  // Makes the best one again if it is not at hand.
  absl::StatusOr<Registration> TakeBest(const Inputs& inputs) && {
    state_.tried[IndexOfBest()].is_kept = true;
    if (!best_) {
      const RegistrationState last = std::move(state_.best);
      LB_ASSIGN_OR_RETURN(
          Candidate again,
          RegisterWith(inputs, KeptPairing(state_.tried, inputs.options.pairing), &last, {}));
      best_ = std::move(again.registration);
    }
    if (state_.tried.size() > 1) best_->report.hypotheses = std::move(state_.tried);
    return *std::move(best_);
  }

 private:
  size_t IndexOfBest() const {
    std::vector<double> costs;
    for (const mesh::Hypothesis& tried : state_.tried) costs.push_back(tried.cost);
    return WinnerOf(costs);
  }

  CompetitionState state_;
  std::optional<Registration> best_;
};

bool MayCompete(const RegistrationOptions& options, int num_iterations) {
  return options.IsGuidedBy(Pairing::kFound) && num_iterations >= kMinIterations;
}

// Errors: kFailedPrecondition if it is not a state of this competition.
absl::Status CheckResumable(const CompetitionState& state, const RegistrationOptions& options,
                            const std::vector<Pairing>& others) {
  std::vector<std::string> names = {Describe(options.pairing)};
  for (const Pairing pairing : others) names.emplace_back(Describe(pairing));
  const bool is_possible = MayCompete(options, state.best.last.num_iterations) &&
                           state.num_others >= 0 && state.num_others <= std::ssize(others);
  size_t n = 0;  // those that could be registered are in the order of all that were tried
  for (int k = 0; is_possible && k <= state.num_others && n < state.tried.size(); ++k) {
    n += state.tried[n].pairing == names[k];
  }
  if (is_possible && n > 0 && n == state.tried.size() && state.tried[0].pairing == names[0]) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat("the state to go on from has tried ", state.tried.size(), " pairings, ",
                   state.num_others, " of them others, and not those of this registration"));
}

// Tries the other pairings that are left.
//   resumed  the state to go on from; null: after the first pairing
absl::StatusOr<Registration> TryOthers(const Inputs& inputs, const CompetitionState* resumed,
                                       Candidates candidates) {
  const std::vector<Pairing> others =
      OtherPairings(inputs.source, inputs.target, inputs.options, inputs.arena);
  const auto keep = [&](const CompetitionState& state) {
    if (inputs.hooks.keep) inputs.hooks.keep(state);
  };
  std::optional<RegistrationState> begun;
  if (resumed != nullptr) {
    LB_RETURN_IF_ERROR(CheckResumable(*resumed, inputs.options, others));
    if (resumed->next) begun = *resumed->next;
  } else if (!others.empty()) {
    keep(candidates.state());
  }
  for (size_t n = candidates.state().num_others; n < others.size(); ++n) {
    absl::StatusOr<Candidate> tried =
        RegisterWith(inputs, others[n], begun ? &*begun : nullptr,
                     [&](const IterationState& next) { keep(candidates.StateWithin(next)); });
    begun.reset();
    if (absl::IsCancelled(tried.status()) || absl::IsFailedPrecondition(tried.status())) {
      return tried.status();
    }
    if (tried.ok()) {
      candidates.Add(others[n], *std::move(tried));
    } else {
      base::LogWarning(absl::StrCat("a pairing cannot be registered (", Describe(others[n]),
                                    "): ", tried.status().ToString()));
    }
    candidates.CountOther();
    keep(candidates.state());
  }
  return std::move(candidates).TakeBest(inputs);
}

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
  const Inputs inputs = {source, target, users, options, arena, hooks};
  if (hooks.resume != nullptr) {
    if (const auto* const state = std::get_if<CompetitionState>(hooks.resume)) {
      return TryOthers(inputs, state, Candidates(*state));
    }
  }
  LB_ASSIGN_OR_RETURN(Candidate first,
                      RegisterWith(inputs, options.pairing, hooks.resume,
                                   [&](const IterationState& state) { hooks.keep(state); }));
  const mesh::RegistrationReport& report = first.registration.report;
  const bool is_good = report.verdict.grade == mesh::Grade::kGood;
  if (is_good || !MayCompete(options, report.num_iterations) || CostOf(report.verdict) < kMinCost) {
    return std::move(first.registration);
  }
  return TryOthers(inputs, nullptr, Candidates(options.pairing, std::move(first)));
}

}  // namespace liquidblend::registration
