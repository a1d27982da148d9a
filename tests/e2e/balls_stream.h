// Frames of the family balls that must come whatever else fails.
#pragma once

#include <memory>

#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {

// A stream that goes on for ever.
class BallsStream {
 public:
  explicit BallsStream(v1::LiquidBlend::Stub& stub) : stream_(stub.StreamFrames(&context_)) {
    v1::StreamFramesRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_loop(true);
    EXPECT_TRUE(stream_->Write(request));
  }
  ~BallsStream() {
    context_.TryCancel();
    stream_->Finish();
  }
  void ExpectFrame() {
    v1::StreamFramesResponse response;
    EXPECT_TRUE(stream_->Read(&response));
    EXPECT_FALSE(response.frame().data().empty());
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamFramesRequest, v1::StreamFramesResponse>>
      stream_;
};

// One call.
inline void ExpectFrame(v1::LiquidBlend::Stub& stub) {
  grpc::ClientContext context;
  v1::GetFrameRequest request;
  request.set_family("families/balls");
  request.add_weights(0.5);
  v1::Frame frame;
  const grpc::Status status = stub.GetFrame(&context, request, &frame);
  EXPECT_TRUE(status.ok()) << status.error_message();
}

}  // namespace liquidblend::e2e
