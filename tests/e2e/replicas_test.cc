// Two servers on one store (PostgreSQL and S3): what one publishes the other serves, soon.
#include <algorithm>
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "liquidblend/client.h"
#include "tests/client/run_command.h"
#include "tests/client/temp_files.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

// What docs/operations/many-machines.md promises is 2 s; a busy machine may take longer.
const absl::Duration kPatience = Slowness() * absl::Seconds(10);
constexpr int kNumRounds = 8;

class ReplicasTest : public E2eTest {
 protected:
  ReplicasTest()
      : first_(StartServer(1)),
        first_address_(Address()),
        second_(StartServer()),
        second_address_(Address()) {
    second_stub_ = std::move(stub_);
    Connect(first_address_);
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
  }

  // Through the first server; returns when it is published.
  void Publish() {
    Operation registration;
    ASSERT_TRUE(Register(1, registration).ok());
    ExpectSuccess(AwaitDone(registration.name()));
  }

  void Delete() {
    grpc::ClientContext context;
    v1::DeleteFamilyRequest request;
    request.set_name("families/balls");
    google::protobuf::Empty empty;
    ASSERT_TRUE(stub_->DeleteFamily(&context, request, &empty).ok());
  }

  // From the second server.
  grpc::Status GetFrame(v1::Frame& frame, int64_t min_version = 0) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_min_version(min_version);
    return second_stub_->GetFrame(&context, request, &frame);
  }

  Process first_;
  const std::string first_address_;
  Process second_;
  const std::string second_address_;
  std::unique_ptr<v1::LiquidBlend::Stub> second_stub_;
};

TEST_F(ReplicasTest, ServeAtOnceTheVersionThatAClientHasHeardOf) {
  for (int version = 1; version <= kNumRounds; ++version) {
    Publish();
    v1::Frame frame;
    const grpc::Status status = GetFrame(frame, version);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(frame.version(), version);
  }
}

TEST_F(ReplicasTest, BeginAStreamWithTheVersionThatAClientHasHeardOf) {
  for (int version = 1; version <= kNumRounds; ++version) {
    Publish();
    grpc::ClientContext context;
    const auto stream = second_stub_->StreamFrames(&context);
    v1::StreamFramesRequest request;
    request.set_family("families/balls");
    request.add_weights(0.5);
    request.set_min_version(version);
    ASSERT_TRUE(stream->Write(request));
    v1::StreamFramesResponse response;
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.frame().version(), version);
    context.TryCancel();
    stream->Finish();
  }
}

// A client that was given both addresses: then others, which know of no version, may go on.
TEST_F(ReplicasTest, ServeAVersionOnceAClientOfAllHasWaitedForIt) {
  ConnectOptions options;
  options.target = first_address_ + "," + second_address_;
  const auto client = Client::Connect(options);
  ASSERT_TRUE(client.ok()) << client.status();
  for (int version = 1; version <= kNumRounds; ++version) {
    Operation registration;
    ASSERT_TRUE(Register(1, registration).ok());
    const auto done = (*client)->WaitOperation(registration.name());
    ASSERT_TRUE(done.ok()) << done.status();
    EXPECT_EQ(done->version, version);
    v1::Frame frame;
    ASSERT_TRUE(GetFrame(frame).ok());
    EXPECT_EQ(frame.version(), version);
  }
}

// Programs that know of no version but by asking: each command is a client of its own.
TEST_F(ReplicasTest, ShowAFamilysNewestVersionToCommandsThatFollowItsRegistration) {
  const liquidblend::testing::TempDir folder;
  const std::string path = folder.File("frame.ply");
  for (int version = 1; version <= kNumRounds; ++version) {
    const liquidblend::testing::CommandResult registered = liquidblend::testing::RunLiquidblend(
        {"--server", first_address_, "--quiet", "register", "balls", "--source", "a", "--target",
         "b", "--iterations", "1", "--replace", "--wait"});
    ASSERT_THAT(registered.exit_code, ::testing::AnyOf(0, 6)) << registered.err;
    const std::string words = absl::StrCat("families/balls version ", version, ",");
    const liquidblend::testing::CommandResult frame =
        liquidblend::testing::RunLiquidblend({"--server", second_address_, "--quiet", "frame",
                                              "balls", "-w", "0.5", "-t", "0", "-o", path});
    EXPECT_EQ(frame.exit_code, 0) << frame.err;
    EXPECT_THAT(frame.out, ::testing::HasSubstr(words));
    const liquidblend::testing::CommandResult exported = liquidblend::testing::RunLiquidblend(
        {"--server", second_address_, "--quiet", "export", "balls", "-w", "0.5", "-o",
         folder.File("out"), "--overwrite"});
    EXPECT_EQ(exported.exit_code, 0) << exported.err;
    EXPECT_THAT(exported.out, ::testing::HasSubstr(words));
  }
}

void PrintTimes(const char* what, std::vector<absl::Duration> times) {
  std::sort(times.begin(), times.end());
  std::printf("%s, %zu times: median %.0f ms, at most %.0f ms\n", what, times.size(),
              absl::ToDoubleMilliseconds(times[times.size() / 2]),
              absl::ToDoubleMilliseconds(times.back()));
  EXPECT_LT(times.back(), kPatience);
}

TEST_F(ReplicasTest, ServeWhatAnotherPublishesAndNotWhatItDeletes) {
  std::vector<absl::Duration> published;
  for (int version = 1; version <= kNumRounds; ++version) {
    Publish();
    const absl::Time start = absl::Now();
    v1::Frame frame;
    // Until it is loaded, the version before is served, and no call fails.
    do {
      const grpc::Status status = GetFrame(frame);
      ASSERT_TRUE(status.ok()) << status.error_message();
    } while (frame.version() < version && absl::Now() < start + kPatience);
    EXPECT_EQ(frame.version(), version);
    published.push_back(absl::Now() - start);
  }
  PrintTimes("a new version is served by the other server", published);

  Delete();
  const absl::Time start = absl::Now();
  v1::Frame frame;
  while (GetFrame(frame).ok() && absl::Now() < start + kPatience) {
  }
  EXPECT_EQ(GetFrame(frame).error_code(), grpc::StatusCode::NOT_FOUND);
  PrintTimes("a deleted family is gone from the other server", {absl::Now() - start});
}

TEST_F(ReplicasTest, ServeNoDeletedFamilyWhileItsNameIsRegisteredAnew) {
  Publish();
  v1::Frame frame;
  ASSERT_TRUE(GetFrame(frame, 1).ok());
  Delete();
  Operation registration;
  ASSERT_TRUE(Register(LongWork(), registration).ok());
  const absl::Time start = absl::Now();
  grpc::Status status;
  while (status.ok() && absl::Now() < start + kPatience) status = GetFrame(frame);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION) << frame.version();
}

}  // namespace
}  // namespace liquidblend::e2e
