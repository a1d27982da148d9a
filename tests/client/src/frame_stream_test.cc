#include "liquidblend/frame_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "liquidblend/client.h"
#include "tests/client/fake_server.h"

namespace liquidblend {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class FrameStreamTest : public ::testing::Test {
 protected:
  FrameStreamTest() {
    ConnectOptions options;
    options.target = server_.target();
    options.retry.initial_backoff = absl::Milliseconds(1);
    client_ = *Client::Connect(options);
  }

  std::unique_ptr<FrameStream> Open(bool lossless) {
    StreamSettings settings;
    settings.family = "drops";
    settings.weights = {0.5};
    settings.lossless = lossless;
    return *client_->StreamFrames(settings);
  }

  testing::FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST_F(FrameStreamTest, ALosslessStreamBringsEveryFrameAndEnds) {
  const auto stream = Open(/*lossless=*/true);
  int64_t count = 0;
  for (;;) {
    const absl::StatusOr<std::optional<StreamedFrame>> streamed = stream->Read();
    ASSERT_TRUE(streamed.ok()) << streamed.status();
    if (!*streamed) break;
    EXPECT_EQ((*streamed)->frame_index, count);
    EXPECT_NEAR((*streamed)->frame.time_s, static_cast<double>(count) / 24.0, 1e-12);
    EXPECT_THAT((*streamed)->frame.weights, ElementsAre(0.5));
    ++count;
  }
  EXPECT_EQ(count, 25);
  EXPECT_FALSE((*stream->Read()).has_value()) << "the end stays the end";
  EXPECT_EQ(stream->Change({}).code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(FrameStreamTest, ChangedWeightsShowInLaterFrames) {
  const auto stream = Open(/*lossless=*/false);
  ASSERT_TRUE(stream->Read().ok());
  StreamSettings change;
  change.weights = {0.75};
  ASSERT_TRUE(stream->Change(change).ok());
  for (;;) {
    const auto streamed = stream->Read();
    ASSERT_TRUE(streamed.ok()) << streamed.status();
    ASSERT_TRUE(streamed->has_value());
    if ((*streamed)->frame.weights == std::vector<double>{0.75}) break;
    ASSERT_THAT((*streamed)->frame.weights, ElementsAre(0.5));
  }
}

TEST_F(FrameStreamTest, ParametersReplaceWeightsInLaterFrames) {
  const auto stream = Open(/*lossless=*/false);
  ASSERT_TRUE(stream->Read().ok());
  StreamSettings change;
  change.parameters = {{"height", 5}};
  change.extrapolate = true;
  ASSERT_TRUE(stream->Change(change).ok());
  for (;;) {
    const auto streamed = stream->Read();
    ASSERT_TRUE(streamed.ok()) << streamed.status();
    ASSERT_TRUE(streamed->has_value());
    if ((*streamed)->frame.extrapolated) {
      EXPECT_THAT((*streamed)->frame.weights, ElementsAre(2.0));
      break;
    }
    ASSERT_THAT((*streamed)->frame.weights, ElementsAre(0.5));
  }
}

TEST_F(FrameStreamTest, TellsTheLevelsThatTheServerHasAdaptedTo) {
  StreamSettings settings;
  settings.family = "drops";
  settings.adapt_level_of_detail = true;
  const auto stream = client_->StreamFrames(settings);
  ASSERT_TRUE(stream.ok()) << stream.status();
  const auto streamed = (*stream)->Read();
  ASSERT_TRUE(streamed.ok()) << streamed.status();
  EXPECT_EQ((*streamed)->level_of_detail, 1);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("adapt_level_of_detail: true"));
}

TEST_F(FrameStreamTest, BitsAndStepReplaceEachOtherAlsoForAStreamThatIsOpenedAgain) {
  server_.FailNext("StreamFrames", 1, absl::UnavailableError("going away"));
  StreamSettings settings;
  settings.family = "drops";
  settings.position_bits = 12;
  const auto stream = client_->StreamFrames(settings);
  ASSERT_TRUE(stream.ok()) << stream.status();
  StreamSettings change;
  change.position_step_m = 0.001;
  (void)(*stream)->Change(change);  // may find the first attempt ended; it counts for the next
  ASSERT_TRUE((*stream)->Read().ok());
  EXPECT_THAT(server_.LastRequest(), HasSubstr("position_step_m: 0.001"));
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("position_bits")));
}

// The fake server has version 3, and knows of no others.
TEST_F(FrameStreamTest, FramesOfAnotherVersionThanTheOneAskedForAreAnError) {
  ASSERT_TRUE(client_->GetFamily("drops").ok());
  StreamSettings settings;
  settings.family = "drops";
  settings.lossless = true;
  settings.version = 3;
  ASSERT_TRUE((*client_->StreamFrames(settings))->Read().ok());
  EXPECT_THAT(server_.LastRequest(), HasSubstr("\nversion: 3"));
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("min_version")));
  settings.version = 2;
  const absl::Status status = (*client_->StreamFrames(settings))->Read().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(std::string(status.message()), HasSubstr("gives version 3 instead of 2"));
}

TEST_F(FrameStreamTest, CancelFromAnotherThreadEndsAWaitingRead) {
  const auto stream = Open(/*lossless=*/false);
  ASSERT_TRUE(stream->Read().ok());
  std::thread canceller([&] { stream->Cancel(); });
  absl::Status status;
  while (status.ok()) status = stream->Read().status();
  canceller.join();
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
}

TEST_F(FrameStreamTest, IsOpenedAgainWhileTheServerIsAway) {
  server_.FailNext("StreamFrames", 2, absl::UnavailableError("going away"));
  const auto stream = Open(/*lossless=*/true);
  const auto streamed = stream->Read();
  ASSERT_TRUE(streamed.ok()) << streamed.status();
  EXPECT_TRUE(streamed->has_value());
  EXPECT_EQ(server_.NumCalls("StreamFrames"), 3);
}

TEST_F(FrameStreamTest, GoesOnWithTheNextFrameWhenItsServerStops) {
  server_.StopNextStream(5);
  const auto stream = Open(/*lossless=*/true);
  for (int k = 0; k < 25; ++k) {
    const auto streamed = stream->Read();
    ASSERT_TRUE(streamed.ok()) << streamed.status();
    ASSERT_TRUE(streamed->has_value()) << k;
    EXPECT_EQ((*streamed)->frame_index, k);
    EXPECT_NEAR((*streamed)->frame.time_s, k / 24.0, 1e-9);
  }
  EXPECT_FALSE((*stream->Read()).has_value());
  EXPECT_EQ(server_.NumCalls("StreamFrames"), 2);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("\nversion: 3"));
}

TEST_F(FrameStreamTest, IsOverIfItsServerStopsAfterTheLastFrame) {
  server_.StopNextStream(25);
  const auto stream = Open(/*lossless=*/true);
  for (int k = 0; k < 25; ++k) ASSERT_TRUE((*stream->Read()).has_value()) << k;
  const auto end = stream->Read();
  ASSERT_TRUE(end.ok()) << end.status();
  EXPECT_FALSE(end->has_value());
  EXPECT_EQ(server_.NumCalls("StreamFrames"), 1);
}

TEST_F(FrameStreamTest, TakesChangesWhileItGoesOverToAnotherServer) {
  server_.StopNextStream(3);
  const auto stream = Open(/*lossless=*/false);
  for (int k = 0; k < 100; ++k) {
    StreamSettings change;
    change.weights = {0.01 * k};
    ASSERT_TRUE(stream->Change(change).ok()) << k;
    const auto streamed = stream->Read();
    ASSERT_TRUE(streamed.ok()) << streamed.status();
    EXPECT_EQ((*streamed)->frame_index, k);
  }
  EXPECT_EQ(server_.NumCalls("StreamFrames"), 2);
  double weight = 0.0;
  while (weight < 0.99) weight = (*stream->Read())->frame.weights[0];
}

TEST_F(FrameStreamTest, GoesOnWithANewerVersionIfItsOwnIsGone) {
  server_.StopNextStream(2);
  const auto stream = Open(/*lossless=*/true);
  ASSERT_TRUE((*stream->Read()).has_value());
  ASSERT_TRUE((*stream->Read()).has_value());
  server_.FailNext("StreamFrames", 1, absl::NotFoundError("family drops has no version 3"));
  const auto streamed = stream->Read();
  ASSERT_TRUE(streamed.ok()) << streamed.status();
  EXPECT_EQ((*streamed)->frame_index, 2);
  EXPECT_THAT(server_.LastRequest(), HasSubstr("min_version: 3"));
}

TEST_F(FrameStreamTest, EndsWithTheConnectionToAnOlderServer) {
  server_.BreakNextStream();
  const auto stream = Open(/*lossless=*/true);
  ASSERT_TRUE((*stream->Read()).has_value());
  ASSERT_TRUE((*stream->Read()).has_value());
  EXPECT_EQ(stream->Read().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(server_.NumCalls("StreamFrames"), 1);
}

TEST_F(FrameStreamTest, TheServersRefusalIsReported) {
  server_.FailNext("StreamFrames", 1, absl::NotFoundError("families/drops does not exist"));
  const absl::Status status = Open(/*lossless=*/true)->Read().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(status.message(), "families/drops does not exist");
}

TEST_F(FrameStreamTest, AnUnreadStreamCanBeDropped) {
  for (int i = 0; i < 3; ++i) Open(/*lossless=*/false);
  EXPECT_TRUE(client_->GetFamily("drops").ok());
}

TEST_F(FrameStreamTest, StartsWithAFamily) {
  EXPECT_EQ(client_->StreamFrames({}).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace liquidblend
