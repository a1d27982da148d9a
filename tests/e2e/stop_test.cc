// SIGTERM: who is connected hears what happens, and nothing that was accepted is lost.
#include <grpcpp/generic/generic_stub.h>
#include <signal.h>

#include <atomic>
#include <thread>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using testing::ElementsAre;

template <typename Detail>
Detail DetailOf(const grpc::Status& status) {
  google::rpc::Status details;
  Detail detail;
  details.ParseFromString(status.error_details());
  for (const auto& any : details.details()) {
    if (any.Is<Detail>()) any.UnpackTo(&detail);
  }
  return detail;
}

// grpc.health.v1.Health/Watch in bytes; its proto is no part of the build.
class HealthWatch {
 public:
  explicit HealthWatch(const std::shared_ptr<grpc::Channel>& channel) : stub_(channel) {
    call_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
    call_->StartCall(nullptr);
    EXPECT_TRUE(Wait());
    call_->Write(grpc::ByteBuffer(&nothing_, 1), nullptr);
    EXPECT_TRUE(Wait());
    call_->WritesDone(nullptr);
    EXPECT_TRUE(Wait());
  }

  ~HealthWatch() {
    context_.TryCancel();
    grpc::Status status;
    call_->Finish(&status, nullptr);
    Wait();
    queue_.Shutdown();
  }

  // 1: serving, 2: not serving; 0: nothing more is said.
  int Next() {
    grpc::ByteBuffer answer;
    grpc::Slice bytes;
    call_->Read(&answer, nullptr);
    if (!Wait() || !answer.DumpToSingleSlice(&bytes).ok() || bytes.size() != 2) return 0;
    return bytes.begin()[1];
  }

 private:
  bool Wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  const grpc::Slice nothing_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

class StopTest : public E2eTest {
 protected:
  void MakeFamily() {
    Process worker = StartWorker();
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    Operation registration;
    ASSERT_TRUE(Register(3, registration).ok());
    ExpectSuccess(AwaitDone(registration.name()));
  }

  grpc::Status GetFrame(double time_s) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_time_s(time_s);
    v1::Frame frame;
    return stub_->GetFrame(&context, request, &frame);
  }
};

TEST_F(StopTest, EveryoneHearsOfItAndWhatWasAcceptedIsThereAfterwards) {
  Operation accepted;
  {
    Process server = StartServer();
    ASSERT_NO_FATAL_FAILURE(MakeFamily());
    HealthWatch health(grpc::CreateChannel(Address(), grpc::InsecureChannelCredentials()));
    EXPECT_EQ(health.Next(), 1);

    grpc::ClientContext stream_context;
    auto stream = stub_->StreamFrames(&stream_context);
    v1::StreamFramesRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_loop(true);
    ASSERT_TRUE(stream->Write(request));
    v1::StreamFramesResponse response;
    ASSERT_TRUE(stream->Read(&response));

    std::atomic<int> num_answered = 0;
    grpc::Status last;
    std::jthread unary([&] {
      while ((last = GetFrame(0.05)).ok()) ++num_answered;
    });
    Await([&] { return num_answered > 10; });
    ASSERT_TRUE(Upload("accepted", BallFiles(1.0), "one", accepted).ok());

    server.Signal(SIGTERM);
    EXPECT_EQ(health.Next(), 2);
    while (stream->Read(&response)) {
    }
    const grpc::Status ended = stream->Finish();
    EXPECT_EQ(ended.error_code(), grpc::StatusCode::UNAVAILABLE) << ended.error_message();
    EXPECT_EQ(DetailOf<google::rpc::ErrorInfo>(ended).reason(), "SHUTTING_DOWN");
    EXPECT_EQ(DetailOf<google::rpc::RetryInfo>(ended).retry_delay().seconds(), 1);
    unary.join();
    EXPECT_EQ(last.error_code(), grpc::StatusCode::UNAVAILABLE) << last.error_message();
    EXPECT_EQ(server.Wait(), 0);
  }
  Process server = StartServer(1);
  EXPECT_THAT(AnimationNames(), ElementsAre("animations/a", "animations/accepted", "animations/b"));
  ExpectSuccess(AwaitDone(accepted.name()));
  Operation again;
  ASSERT_TRUE(Upload("accepted", BallFiles(1.0), "one", again).ok());
  EXPECT_EQ(again.name(), accepted.name());
}

}  // namespace
}  // namespace liquidblend::e2e
