// What a Client holds: the channel, its stubs, and how a call is made. Includes gRPC: only for the
// sources that make calls.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "client/src/retry.h"
#include "client/src/status.h"
#include "google/longrunning/operations.grpc.pb.h"
#include "liquidblend/client.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"

namespace liquidblend {

class Client::Impl {
 public:
  using Service = v1::LiquidBlend::Stub;
  using Operations = google::longrunning::Operations::Stub;

  Impl(const ConnectOptions& connect_options, std::shared_ptr<grpc::Channel> open_channel)
      : options(connect_options), channel(std::move(open_channel)) {}

  // Makes a short call that may be repeated, with the deadline and retries of the options.
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(Stub& stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                             Response*),
                                const Request& request) {
    Response response;
    absl::Status status = client::RetryUnavailable(options.retry, [&](int) {
      grpc::ClientContext context;
      SetTimeout(options.call_timeout, &context);
      return client::FromGrpc((stub.*method)(&context, request, &response));
    });
    if (!status.ok()) return status;
    return response;
  }

  // Likewise for a deletion: not found at a second attempt means that the first one did it.
  template <typename Stub, typename Request>
  absl::Status CallDelete(Stub& stub,
                          grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                       google::protobuf::Empty*),
                          const Request& request) {
    return client::RetryUnavailable(options.retry, [&](int attempt) {
      grpc::ClientContext context;
      SetTimeout(options.call_timeout, &context);
      google::protobuf::Empty empty;
      const absl::Status status = client::FromGrpc((stub.*method)(&context, request, &empty));
      return attempt > 1 && absl::IsNotFound(status) ? absl::OkStatus() : status;
    });
  }

  static void SetTimeout(absl::Duration timeout, grpc::ClientContext* context) {
    if (timeout == absl::InfiniteDuration()) return;
    context->set_deadline(std::chrono::system_clock::now() + absl::ToChronoMicroseconds(timeout));
  }

  const ConnectOptions options;
  const std::shared_ptr<grpc::Channel> channel;
  Service service{channel};
  Operations operations{channel};
};

}  // namespace liquidblend
