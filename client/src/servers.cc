#include "client/src/servers.h"

#include <algorithm>
#include <chrono>

#include "absl/strings/match.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/src/connection_failure.h"
#include "client/src/credentials.h"
#include "client/src/loopback.h"
#include "client/src/status_macros.h"

namespace liquidblend::client {
namespace {

constexpr int kMaxMessageBytes = 1 << 30;  // a frame of some hundred million triangles
constexpr int kConnectMs = 5000;           // then the address counts as one that cannot be reached
constexpr int kResolveMs = 3000;           // for one look-up of a name, of any kind of address
constexpr absl::Duration kGlance = absl::Milliseconds(50);
constexpr absl::Duration kLongestLook = absl::Milliseconds(500);

grpc::ChannelArguments ArgumentsFor(const ConnectOptions& options, const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
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

std::chrono::system_clock::time_point ToChrono(absl::Time time) {
  return time == absl::InfiniteFuture() ? std::chrono::system_clock::time_point::max()
                                        : absl::ToChronoTime(time);
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
    servers->servers_.push_back(std::make_unique<Server>(
        address, grpc::CreateCustomChannel(address, credentials, ArgumentsFor(options, address))));
  }
  return servers;
}

bool Servers::WaitForAny(absl::Time deadline) {
  for (const auto& server : servers_) server->channel->GetState(/*try_to_connect=*/true);
  const bool is_only_one = servers_.size() == 1;
  do {
    for (size_t k = 0; k < servers_.size(); ++k) {
      const absl::Time end = is_only_one ? deadline : std::min(deadline, absl::Now() + kGlance);
      current_ = k;
      if (servers_[k]->channel->WaitForConnected(ToChrono(end))) return true;
    }
  } while (absl::Now() < deadline);
  return false;
}

std::string Servers::ExplainFailure(bool uses_tls) {
  // A call that does not wait for a connection ends with the words of the last attempt.
  grpc::ClientContext context;
  context.set_deadline(ToChrono(absl::Now() + kLongestLook));
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

void Servers::Leave(const Server& left) {
  for (size_t k = 0; k < servers_.size(); ++k) {
    size_t expected = k;
    if (servers_[k].get() == &left) {
      current_.compare_exchange_strong(expected, (k + 1) % servers_.size());
    }
  }
}

absl::Status Servers::TryEach(const std::function<absl::Status(Server& server)>& call) {
  absl::Status status;
  for (size_t k = 0; k < servers_.size(); ++k) {
    Server& server = current();
    status = call(server);
    if (!absl::IsUnavailable(status)) return status;
    Leave(server);
  }
  return status;
}

}  // namespace liquidblend::client
