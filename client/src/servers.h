// The servers of a client, and the current one. Includes gRPC: only for the sources that make
// calls.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "google/longrunning/operations.grpc.pb.h"
#include "liquidblend/client.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"

namespace liquidblend::client {

using ServiceStub = v1::LiquidBlend::Stub;
using OperationsStub = google::longrunning::Operations::Stub;

struct Server {
  Server(std::string host_and_port, std::shared_ptr<grpc::Channel> open_channel)
      : address(std::move(host_and_port)),
        channel(std::move(open_channel)),
        stubs(channel, channel) {}
  ServiceStub& service() { return std::get<ServiceStub>(stubs); }
  OperationsStub& operations() { return std::get<OperationsStub>(stubs); }

  const std::string address;
  const std::shared_ptr<grpc::Channel> channel;
  std::tuple<ServiceStub, OperationsStub> stubs;
};

// The addresses in ConnectOptions::target: "a:1,b:2" are two, "ipv4:1.2.3.4:1,1.2.3.5:1" is one.
std::vector<std::string> AddressesIn(const std::string& target);

// Threads: safe.
class Servers {
 public:
  // One channel an address.  Errors: kInvalidArgument, kNotFound: see CredentialsOf() and
  // CheckTokenIsSafe().
  static absl::StatusOr<std::unique_ptr<Servers>> Open(const ConnectOptions& options);

  // Selects the first server that can be reached; false if none can before the deadline.
  bool WaitForAny(absl::Time deadline);

  // Explains to the user why the first server cannot be reached; empty if the reason is not known.
  // Takes up to half a second.
  std::string ExplainFailure(bool uses_tls);

  // All servers, in the order of the addresses.
  std::vector<Server*> All() const;

  Server& current() { return *servers_[current_]; }

  // Selects the next server, as `left` could not be reached, unless another thread has done so.
  void Leave(const Server& left);

  // Runs `call` with the current server, and as long as it is kUnavailable with the others, each
  // once.
  absl::Status TryEach(const std::function<absl::Status(Server& server)>& call);

 private:
  std::vector<std::unique_ptr<Server>> servers_;  // never empty
  std::atomic<size_t> current_ = 0;
};

}  // namespace liquidblend::client
