#include "client/player/server_source.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::player {
namespace {

// A call that hangs is given up after that, so that a player ends soon.
constexpr absl::Duration kLongestCall = absl::Seconds(5);

}  // namespace

FamilyFacts FactsOf(const Family& family) {
  FamilyFacts facts;
  facts.name = family.name;
  facts.version = family.version;
  facts.targets = family.targets;
  facts.duration_s = family.duration_s;
  facts.frames_per_second = family.frames_per_second;
  facts.num_levels = 1 + static_cast<int>(family.coarser_levels.size());
  facts.up = family.up;
  facts.bounds = family.bounds;
  facts.parameter_space = family.parameter_space;
  return facts;
}

absl::StatusOr<std::unique_ptr<ServerSource>> ServerSource::Open(ConnectOptions options,
                                                                 const std::string& family,
                                                                 int64_t version) {
  options.retry.max_attempts = 1;
  options.retry.patience = absl::ZeroDuration();
  LB_ASSIGN_OR_RETURN(std::unique_ptr<Client> patient, Client::Connect(options));
  options.call_timeout = std::min(options.call_timeout, kLongestCall);
  LB_ASSIGN_OR_RETURN(std::unique_ptr<Client> client, Client::Connect(options));
  LB_ASSIGN_OR_RETURN(const Family found, client->GetFamily(family, version));
  if (found.version == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat(found.name, ": no version is registered yet"));
  }
  return std::unique_ptr<ServerSource>(
      new ServerSource(std::move(client), std::move(patient), found));
}

ServerSource::ServerSource(std::unique_ptr<Client> client, std::unique_ptr<Client> patient,
                           const Family& family)
    : client_(std::move(client)),
      patient_client_(std::move(patient)),
      fetcher_(*client_),
      patient_fetcher_(*patient_client_),
      facts_(FactsOf(family)) {}

absl::Status ServerSource::Get(const FrameSpec& spec, FramePool& pool, FrameMesh& out,
                               FrameCost& cost) {
  FrameRequest request;
  request.family = facts_.name;
  request.version = facts_.version;
  request.weights = spec.blend.weights;
  request.parameters = spec.blend.parameters;
  request.extrapolate = spec.blend.extrapolate;
  request.time_s = spec.time_s;
  request.position_bits = spec.position_bits;
  request.surface = spec.surface;
  request.format = spec.format;
  return (spec.is_exact ? patient_fetcher_ : fetcher_).Get(request, pool, out, cost);
}

}  // namespace liquidblend::player
