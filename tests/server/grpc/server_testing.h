// A server on a store of its own, and clients of it.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <utility>

#include "google/longrunning/operations.grpc.pb.h"
#include "google/rpc/status.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "server/grpc/server.h"
#include "tests/server/backends_testing.h"

namespace liquidblend::server {

using google::longrunning::Operation;
using google::longrunning::Operations;

MATCHER_P2(EndsWith, code, words, "") {
  *result_listener << arg.error_code() << ": " << arg.error_message();
  return arg.error_code() == code && absl::StrContains(arg.error_message(), words);
}

MATCHER(IsOk, "") {
  *result_listener << arg.error_code() << ": " << arg.error_message();
  return arg.ok();
}

// The google.rpc detail of this type in a status; empty if there is none.
template <typename Detail>
Detail DetailOf(const grpc::Status& status) {
  google::rpc::Status details;
  Detail detail;
  if (!details.ParseFromString(status.error_details())) return detail;
  for (const auto& any : details.details()) {
    if (any.Is<Detail>()) any.UnpackTo(&detail);
  }
  return detail;
}

// Of a stream of all frames of the family splash.
inline v1::StreamFramesRequest Lossless() {
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_lossless(true);
  return request;
}

class ServerTest : public RpcTest {
 protected:
  void SetUp() override { Start(ServerOptions()); }

  // What the server works with.
  virtual store::Catalog& served_catalog() { return *catalog_; }
  virtual store::BlobStore& served_blobs() { return *blobs_; }

  // Another server in place of the one that there is. Of the limits, what its workers can hold is
  // as given.
  void Start(ServerOptions options) {
    options.listen = "127.0.0.1:0";
    const int64_t worker_memory_bytes = options.limits.worker_memory_bytes;
    options.limits = SmallLimits();
    options.limits.worker_memory_bytes = worker_memory_bytes;
    auto server = Server::Start(served_catalog(), served_blobs(), families_, options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials());
    stub_ = v1::LiquidBlend::NewStub(channel_);
    operations_ = Operations::NewStub(channel_);
  }

  // Calls a method of a service whose messages we do not have, in bytes.
  std::pair<grpc::Status, std::string> CallRaw(const std::string& method,
                                               const std::string& request) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    grpc::Slice slice(request);
    grpc::ByteBuffer buffer(&slice, 1);
    grpc::GenericStub stub(channel_);
    auto call = stub.PrepareUnaryCall(&context, method, buffer, &queue);
    call->StartCall();
    grpc::ByteBuffer reply;
    grpc::Status status;
    call->Finish(&reply, &status, this);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    std::string bytes;
    grpc::Slice whole;
    if (reply.Valid() && reply.DumpToSingleSlice(&whole).ok()) {
      bytes.assign(reinterpret_cast<const char*>(whole.begin()), whole.size());
    }
    return {status, bytes};
  }

  // 1: serving, 2: not serving (grpc.health.v1).
  int Health(const std::string& service) {
    std::string request;
    if (!service.empty()) {
      request = absl::StrCat("\n", std::string(1, static_cast<char>(service.size())), service);
    }
    const auto [status, reply] = CallRaw("/grpc.health.v1.Health/Check", request);
    EXPECT_THAT(status, IsOk());
    return reply.size() == 2 ? reply[1] : 0;
  }

  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::LiquidBlend::Stub> stub_;
  std::unique_ptr<Operations::Stub> operations_;
};

}  // namespace liquidblend::server
