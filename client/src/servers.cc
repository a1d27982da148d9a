#include "client/src/servers.h"

#include <algorithm>
#include <chrono>
#include <random>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/src/connection/connection_failure.h"
#include "client/src/connection/loopback.h"
#include "client/src/credentials.h"
#include "client/src/reason.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

constexpr int kMaxMessageBytes = 1 << 30;  // a frame of some hundred million triangles
constexpr int kOnlyIdentity = 1 << GRPC_COMPRESS_NONE;
constexpr int kConnectMs = 5000;     // then the address counts as one that cannot be reached
constexpr int kResolveMs = 3000;     // for one look-up of a name, of any kind of address
constexpr int kIdleMs = 5 * 60'000;  // then connections without a call end
constexpr absl::Duration kGlance = absl::Milliseconds(50);
constexpr absl::Duration kLongestGlance = absl::Milliseconds(100);  // as it is counted
constexpr absl::Duration kLongestLook = absl::Milliseconds(500);
constexpr absl::Duration kHealthPatience = absl::Milliseconds(250);  // for a healthy server
constexpr absl::Duration kAvoidance = absl::Seconds(1);  // of a server that has refused a call
constexpr absl::Duration kRepeatPause = absl::Milliseconds(20);
constexpr int kMaxRepeats = 2;
constexpr char kShuttingDown[] = "SHUTTING_DOWN";  // a reason of the server's (docs/errors.md)

// Part of a service config: answers have at most 64 MiB, pages of lists 16 MiB, since the smallest
// items take a hundred times their bytes, and those that hold a frame kMaxMessageBytes.
constexpr char kLimits[] = R"("methodConfig": [
  {"name": [{}], "maxResponseMessageBytes": 67108864},
  {"name": [{"service": "liquidblend.v1.LiquidBlend", "method": "ListAnimations"},
            {"service": "liquidblend.v1.LiquidBlend", "method": "ListFamilies"},
            {"service": "google.longrunning.Operations", "method": "ListOperations"}],
   "maxResponseMessageBytes": 16777216},
  {"name": [{"service": "liquidblend.v1.LiquidBlend", "method": "GetFrame"},
            {"service": "liquidblend.v1.LiquidBlend", "method": "StreamFrames"}],
   "maxResponseMessageBytes": 1073741824}])";

// Likewise: calls of one name go to all of its servers in turn that say that they are healthy.
constexpr char kBalanced[] =
    R"("loadBalancingConfig": [{"round_robin": {}}], "healthCheckConfig": {"serviceName": ""})";

grpc::ChannelArguments ArgumentsFor(const ConnectOptions& options, const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_CLIENT_IDLE_TIMEOUT_MS, kIdleMs);
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  // gRPC compares the size of a compressed answer with the limit before it decompresses it. Our
  // servers compress none.
  arguments.SetInt(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  arguments.SetInt(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, kOnlyIdentity);
  arguments.SetInt(GRPC_ARG_ENABLE_RETRIES, 0);  // the client counts its own
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kConnectMs);
  // A server that was replaced may have another address, and an answer of DNS may be lost.
  arguments.SetInt(GRPC_ARG_DNS_MIN_TIME_BETWEEN_RESOLUTIONS_MS, 1000);
  arguments.SetInt(GRPC_ARG_DNS_ARES_QUERY_TIMEOUT_MS, kResolveMs);
  // A host that has vanished without a word is found out while a call waits, a watch without a
  // deadline too. The server allows such pings (server/grpc/server.cc).
  const auto keepalive_ms = static_cast<int>(absl::ToInt64Milliseconds(options.keepalive));
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, keepalive_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, keepalive_ms);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // no limit
  // Channels to this machine must not go through a proxy of the environment (http_proxy): that
  // one would read the token, and reach another machine under this one's name.
  if (IsThisMachine(address)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const std::string& name = options.security.tls_server_name;
  if (!name.empty()) arguments.SetSslTargetNameOverride(name);
  return arguments;
}

int64_t SteadyMicros() {
  return absl::ToInt64Microseconds(
      absl::FromChrono(std::chrono::steady_clock::now().time_since_epoch()));
}

// Whether gRPC has not sent a call because no server of the name says that it is healthy. Its words
// are "backend unhealthy" and "health check call failed".
bool IsUnhealthy(const absl::Status& status) {
  return absl::StrContains(std::string(status.message()), "health");
}

}  // namespace

std::vector<std::string> AddressesIn(const std::string& target) {
  for (const char* scheme : {"ipv4:", "ipv6:"}) {
    if (absl::StartsWith(target, scheme)) return {target};
  }
  return absl::StrSplit(target, ',');
}

absl::StatusOr<std::unique_ptr<Servers>> Servers::Open(const ConnectOptions& options) {
  auto servers = std::make_unique<Servers>();
  LBC_ASSIGN_OR_RETURN(const std::shared_ptr<grpc::ChannelCredentials> credentials,
                       CredentialsOf(options.security));
  for (const std::string& address : AddressesIn(options.target)) {
    LBC_RETURN_IF_ERROR(CheckTokenIsSafe(options.security, address));
    // A second service config for the same arguments would not count.
    const auto open = [&](const std::string& service_config) {
      grpc::ChannelArguments arguments = ArgumentsFor(options, address);
      arguments.SetServiceConfigJSON(service_config);
      return std::make_unique<Server>(address,
                                      grpc::CreateCustomChannel(address, credentials, arguments));
    };
    servers->unchecked_.push_back(open(absl::StrCat("{", kLimits, "}")));
    servers->servers_.push_back(open(absl::StrCat("{", kBalanced, ", ", kLimits, "}")));
    servers->servers_.back()->unchecked = servers->unchecked_.back().get();
  }
  servers->next_ = std::random_device{}();  // so that programs of one call spread, too
  return servers;
}

bool Servers::WaitForAny(absl::Duration patience) {
  absl::Duration waited;
  const auto is_reached = [&](const std::vector<std::unique_ptr<Server>>& servers) {
    for (const auto& server : servers) server->channel->GetState(/*try_to_connect=*/true);
    return std::any_of(servers.begin(), servers.end(), [&](const auto& server) {
      const int64_t begin_us = SteadyMicros();
      const absl::Time end = absl::Now() + std::min(kGlance, patience - waited);
      const bool is_connected = server->channel->WaitForConnected(absl::ToChronoTime(end));
      waited += std::min(absl::Microseconds(SteadyMicros() - begin_us), kLongestGlance);
      return is_connected;
    });
  };
  do {
    if (is_reached(servers_)) return true;
    if (waited >= kHealthPatience && is_reached(unchecked_)) return true;
  } while (waited < patience);
  return false;
}

std::string Servers::ExplainFailure(bool uses_tls) {
  // A call that does not wait for a connection ends with the words of the last attempt.
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + kLongestLook));
  google::longrunning::Operation unused;
  const grpc::Status status = servers_.front()->operations().GetOperation(
      &context, google::longrunning::GetOperationRequest(), &unused);
  return ExplainConnectionFailure(status.error_message(), uses_tls);
}

std::vector<Server*> Servers::All() const {
  std::vector<Server*> all;
  for (const auto& server : servers_) all.push_back(server.get());
  return all;
}

// The turn goes round those that are ready, so that none of them gets the calls of one that is not.
Servers::Round Servers::Begin(Server* first) {
  const int64_t now_us = SteadyMicros();
  std::vector<Server*> ready, others;
  for (const auto& server : servers_) {
    if (server.get() == first) continue;
    const bool is_ready = server->channel->GetState(/*try_to_connect=*/true) == GRPC_CHANNEL_READY;
    (is_ready && server->avoided_until_us <= now_us ? ready : others).push_back(server.get());
  }
  const size_t turn = next_.fetch_add(1, std::memory_order_relaxed);
  std::vector<Server*>& from = ready.empty() ? others : ready;
  if (!from.empty()) std::rotate(from.begin(), from.begin() + turn % from.size(), from.end());
  Round round;
  if (first != nullptr) round.left_.push_back({first, absl::ZeroDuration()});
  for (Server* const server : ready) round.left_.push_back({server, absl::ZeroDuration()});
  for (Server* const server : others) round.left_.push_back({server, absl::ZeroDuration()});
  return round;
}

Server* Servers::Round::Next() {
  std::deque<Turn>& turns = left_.empty() ? last_resort_ : left_;
  if (turns.empty()) return nullptr;
  const Turn turn = turns.front();
  turns.pop_front();
  absl::SleepFor(turn.pause);
  asked_ = turn.server;
  return asked_;
}

void Servers::Round::OnUnavailable(const absl::Status& status) {
  asked_->avoided_until_us = SteadyMicros() + absl::ToInt64Microseconds(kAvoidance);
  if (asked_->unchecked == nullptr) return;
  if (ReasonOf(status) == kShuttingDown && num_repeats_ < kMaxRepeats) {
    ++num_repeats_;
    left_.push_back({asked_, kRepeatPause});
  }
  if (IsUnhealthy(status)) last_resort_.push_back({asked_->unchecked, absl::ZeroDuration()});
}

absl::Status Servers::TryEach(const std::function<absl::Status(Server& server)>& call) {
  Server* nobody = nullptr;
  return TryEach(call, &nobody);
}

absl::Status Servers::TryEach(const std::function<absl::Status(Server& server)>& call,
                              Server** preferred) {
  absl::Status status;
  Round round = Begin(*preferred);
  while (Server* const server = round.Next()) {
    status = call(*server);
    *preferred = absl::IsUnavailable(status) ? nullptr : server;
    if (*preferred != nullptr) break;
    round.OnUnavailable(status);
  }
  return status;
}

}  // namespace liquidblend::client
