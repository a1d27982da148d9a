// The servers of a client, and which of them to ask next. Includes gRPC: only for the sources that
// make calls.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
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

// One address, which may be a name of several servers: calls go to all of them in turn that say
// that they are healthy (grpc.health.v1).
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
  Server* unchecked = nullptr;  // the same, whether servers are healthy or not; null: this one is
  std::atomic<int64_t> avoided_until_us = 0;  // by the steady clock; others are asked first
};

// The addresses in ConnectOptions::target: "a:1,b:2" are two, "ipv4:1.2.3.4:1,1.2.3.5:1" is one.
std::vector<std::string> AddressesIn(const std::string& target);

// Threads: safe.
class Servers {
 public:
  // One attempt at a call: the servers to ask, one after the other. Threads: one.
  class Round {
   public:
    // The next server; null: all have been asked. Waits some milliseconds before a server is asked
    // again.
    Server* Next();
    // To be called if the server that Next() returned last could not be reached, or refused.
    void OnUnavailable(const absl::Status& status);

   private:
    friend class Servers;
    struct Turn {
      Server* server;
      absl::Duration pause;
    };
    std::deque<Turn> left_;         // to be asked
    std::deque<Turn> last_resort_;  // to be asked after them
    Server* asked_ = nullptr;
    int num_repeats_ = 0;
  };

  // One channel an address.  Errors: kInvalidArgument, kNotFound: see CredentialsOf() and
  // CheckTokenIsSafe().
  static absl::StatusOr<std::unique_ptr<Servers>> Open(const ConnectOptions& options);

  // Waits until a server can be reached; false if none can be in so much time. Time in which this
  // program does not run, such as that of a virtual machine that is paused, is not counted.
  bool WaitForAny(absl::Duration patience);

  // Explains to the user why the first server cannot be reached; empty if the reason is not known.
  // Takes up to half a second.
  std::string ExplainFailure(bool uses_tls);

  // All servers, in the order of the addresses.
  std::vector<Server*> All() const;

  // Begins an attempt at `first`, unless that is null. It goes on with the servers that are ready,
  // from the next in turn on, then with the others. One that shuts down is asked again, as its name
  // may have other servers; one that is not healthy in the end, if nobody else has answered.
  Round Begin(Server* first = nullptr);

  // Runs `call` with the servers of one attempt until it is not kUnavailable.
  absl::Status TryEach(const std::function<absl::Status(Server& server)>& call);
  // Likewise, with `*preferred` first, unless that is null. Sets it to the server that has
  // answered, or to null.
  absl::Status TryEach(const std::function<absl::Status(Server& server)>& call, Server** preferred);

 private:
  std::vector<std::unique_ptr<Server>> servers_;    // never empty
  std::vector<std::unique_ptr<Server>> unchecked_;  // of the same addresses
  std::atomic<size_t> next_ = 0;                    // whose turn it is
};

}  // namespace liquidblend::client
