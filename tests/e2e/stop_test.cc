// SIGTERM: who is connected hears what happens, and nothing that was accepted is lost.
#include <grpcpp/generic/generic_stub.h>
#include <signal.h>

#include <atomic>
#include <thread>

#include "absl/strings/str_cat.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "liquidblend/client.h"
#include "tests/client/run_command.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using liquidblend::testing::CommandResult;
using liquidblend::testing::RunLiquidblendUntil;
using ::testing::ElementsAre;

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

  // In place of one that was there, with a worker.
  Process StartServerAt(const std::string& address) {
    std::vector<std::string> arguments = StoreArguments();
    arguments.insert(arguments.end(),
                     {"--listen", address, "--worker-lease", lease_, "--workers", "1"});
    return Process("liquidblend-server", arguments, WithStore());
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

// Its calls are made once: what it waits for is the server's return.
TEST_F(StopTest, AClientThatWaitsGoesOnWhenTheServerIsBack) {
  Process server = StartServer();
  if (server.pid() <= 0) GTEST_SKIP() << "the servers run already";
  const std::string address = Address();
  ConnectOptions options;
  options.target = address;
  options.retry.max_attempts = 1;
  options.retry.patience = absl::FromChrono(Patience());
  const auto client = Client::Connect(options);
  ASSERT_TRUE(client.ok()) << client.status();
  const std::string name = ImportBall("a", 1.0).name();  // nobody works on it yet
  std::atomic<bool> is_watched = false;
  absl::StatusOr<liquidblend::Operation> done = absl::UnknownError("not run");
  std::thread waiting([&] {
    done = (*client)->WatchOperation(name, [&](const liquidblend::Operation&) {
      is_watched = true;
      return true;
    });
  });
  Await([&] { return is_watched.load(); });
  server.Kill();
  const Process again = StartServerAt(address);
  waiting.join();
  ASSERT_TRUE(done.ok()) << done.status();
  EXPECT_TRUE(done->result.ok()) << done->result;
}

// As at an upgrade: the server ends by itself, and another takes its place.
TEST_F(StopTest, ACommandThatWaitsGoesOnWhenAnotherServerTakesThePlace) {
  Process server = StartServer();
  if (server.pid() <= 0) GTEST_SKIP() << "the servers run already";
  const std::string address = Address();
  const std::string name = ImportBall("a", 1.0).name();  // nobody works on it yet
  Process again;
  const CommandResult result =
      RunLiquidblendUntil({"--server", address, "--patience", absl::StrCat(Patience().count()),
                           "operations", name, "--wait"},
                          "queued", [&] {
                            server.Signal(SIGTERM);
                            EXPECT_EQ(server.Wait(), 0);
                            again = StartServerAt(address);
                          });
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(StopTest, ACommandWithoutPatienceNamesItsOperation) {
  Process server = StartServer();
  if (server.pid() <= 0) GTEST_SKIP() << "the servers run already";
  const std::string name = ImportBall("a", 1.0).name();
  const CommandResult result = RunLiquidblendUntil(
      {"--server", Address(), "--patience", "0", "operations", name, "--wait"}, "queued", [&] {
        server.Signal(SIGTERM);
        EXPECT_EQ(server.Wait(), 0);
      });
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, ::testing::HasSubstr(name +
                                               " may go on nevertheless: `liquidblend "
                                               "operations " +
                                               name + " --wait` watches it"));
}

absl::StatusOr<std::unique_ptr<Client>> ConnectWithoutPatience(const std::string& address) {
  ConnectOptions options;
  options.target = address;
  options.retry.max_attempts = 1;
  options.retry.patience = absl::ZeroDuration();
  return Client::Connect(options);
}

TEST_F(StopTest, AClientThatLosesItsServerIsToldOfTheOperationItAskedFor) {
  Process server = StartServer();
  if (server.pid() <= 0) GTEST_SKIP() << "the servers run already";
  const auto client = ConnectWithoutPatience(Address());
  ASSERT_TRUE(client.ok()) << client.status();
  server.Kill();
  for (const absl::Status& lost : {(*client)->GetOperation("operations/7").status(),
                                   (*client)->CancelOperation("operations/7")}) {
    EXPECT_EQ(lost.code(), absl::StatusCode::kUnavailable);
    EXPECT_THAT(std::string(lost.message()),
                ::testing::HasSubstr("; operations/7 may go on nevertheless: `liquidblend "));
  }
}

TEST_F(StopTest, AClientWhosePatienceEndsIsToldOfItsOperation) {
  Process server = StartServer();
  if (server.pid() <= 0) GTEST_SKIP() << "the servers run already";
  const auto client = ConnectWithoutPatience(Address());
  ASSERT_TRUE(client.ok()) << client.status();
  const std::string name = ImportBall("a", 1.0).name();
  const auto lost = (*client)->WatchOperation(name, [&](const liquidblend::Operation&) {
    server.Kill();
    return true;
  });
  EXPECT_EQ(lost.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(lost.status().message()),
              ::testing::HasSubstr(name + " may go on nevertheless: `liquidblend operations " +
                                   name + " --wait` watches it"));
}

}  // namespace
}  // namespace liquidblend::e2e
