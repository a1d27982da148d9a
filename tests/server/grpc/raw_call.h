// Calls by the name of the method, of whatever kind it is, with messages as bytes.
#pragma once

#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "google/protobuf/descriptor.h"

namespace liquidblend::server {

using MethodDescriptor = google::protobuf::MethodDescriptor;

// All methods of the server's own services.
inline std::vector<const MethodDescriptor*> AllMethods() {
  std::vector<const MethodDescriptor*> methods;
  for (const char* name : {"liquidblend.v1.LiquidBlend", "google.longrunning.Operations"}) {
    const auto* service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int k = 0; k < service->method_count(); ++k) methods.push_back(service->method(k));
  }
  return methods;
}

inline std::string PathOf(const MethodDescriptor& method) {
  return "/" + method.service()->full_name() + "/" + method.name();
}

// A request in protobuf's text format -> its bytes.
inline std::string FromText(const MethodDescriptor& method, const std::string& text) {
  const std::unique_ptr<google::protobuf::Message> message(
      google::protobuf::MessageFactory::generated_factory()
          ->GetPrototype(method.input_type())
          ->New());
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, message.get())) << text;
  return message->SerializeAsString();
}

// Sends the messages and half-closes; reads some of the answers, cancels if there are more.
inline grpc::Status CallInBytes(const std::shared_ptr<grpc::Channel>& channel,
                                const std::string& path, const std::vector<std::string>& messages,
                                const std::string& token = "",
                                std::chrono::milliseconds patience = std::chrono::seconds(20)) {
  constexpr int kMaxAnswers = 3;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + patience);
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  grpc::GenericStub stub(channel);
  const auto call = stub.PrepareCall(&context, path, &queue);
  call->StartCall(nullptr);
  bool is_open = wait();
  for (const std::string& message : messages) {
    const grpc::Slice slice(message);
    if (is_open) {
      call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      is_open = wait();
    }
  }
  if (is_open) {
    call->WritesDone(nullptr);
    wait();
  }
  int num_answers = 0;
  grpc::ByteBuffer answer;
  do {
    call->Read(&answer, nullptr);
  } while (wait() && ++num_answers < kMaxAnswers);
  if (num_answers == kMaxAnswers) context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  queue.Shutdown();
  return status;
}

}  // namespace liquidblend::server
