#include "client/cli/export/frame_source.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "client/cli/flags/blend_flags.h"
#include "tests/client/fake_server.h"

namespace liquidblend::cli {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class FrameSourceTest : public ::testing::Test {
 protected:
  FrameSourceTest() {
    ConnectOptions options;
    options.target = server_.target();
    client_ = *Client::Connect(options);
  }

  absl::StatusOr<std::unique_ptr<FrameSource>> Open(const std::string& weights,
                                                    const FrameClock& clock) {
    StreamSettings settings;
    settings.family = "drops";
    return OpenFrames(*client_, settings, *ToBlendCurve({weights, "", false}), clock);
  }

  // Frames until the end or an error, the latter as *error.
  int Count(const std::string& weights, const FrameClock& clock, absl::Status* error) {
    const absl::StatusOr<std::unique_ptr<FrameSource>> source = Open(weights, clock);
    *error = source.status();
    if (!source.ok()) return 0;
    for (int count = 0;; ++count) {
      const absl::StatusOr<std::optional<Frame>> frame = (*source)->Next();
      *error = frame.status();
      if (!frame.ok() || !frame->has_value()) return count;
    }
  }

  testing::FakeServer server_;
  std::unique_ptr<Client> client_;
};

TEST_F(FrameSourceTest, GivesAllFramesOfACurveAndOfAStream) {
  for (const char* weights : {"0.5", "0:0/1:1"}) {
    absl::Status error;
    EXPECT_EQ(Count(weights, {24.0, 1.0}, &error), 25) << weights;
    EXPECT_TRUE(error.ok()) << error;
  }
}

TEST_F(FrameSourceTest, RefusesClocksOfMoreFramesThanAreExported) {
  const FrameClock clocks[] = {{1e300, 1.0}, {24.0, kNan},  {24.0, kInfinity}, {24.0, -1.0},
                               {kNan, 1.0},  {-24.0, 1.0},  {-24.0, -1.0},     {kInfinity, 1.0},
                               {1e6, 1.0},   {0, kInfinity}};
  for (const FrameClock& clock : clocks) {
    for (const char* weights : {"0.5", "0:0/1:1"}) {
      const absl::Status status = Open(weights, clock).status();
      EXPECT_TRUE(absl::IsInvalidArgument(status)) << clock.frames_per_second << status;
      EXPECT_NE(std::string(status.message()).find("frames per second are not between 1 and"),
                std::string::npos)
          << status;
    }
  }
  EXPECT_TRUE(Open("0:0/1:1", {99'999.0, 10.0}).ok());
}

// The server sends 25 frames, of a family that it has said to have 7.
TEST_F(FrameSourceTest, EndsAStreamThatGoesOnAfterItsLastFrame) {
  absl::Status error;
  const int count = Count("0.5", {24.0, 0.25}, &error);
  EXPECT_TRUE(absl::IsDataLoss(error)) << error;
  EXPECT_GE(count, 7);
  EXPECT_LE(count, 9);
}

TEST_F(FrameSourceTest, EndsAStreamThatIsSilent) {
  StreamSettings settings;
  settings.family = "drops";
  server_.HoldNextStream(0);
  const auto source = OpenFrames(*client_, settings, *ToBlendCurve({"0.5", "", false}), {24.0, 1.0},
                                 absl::Milliseconds(200));
  ASSERT_TRUE(source.ok()) << source.status();
  const absl::Status status = (*source)->Next().status();
  EXPECT_EQ(status, absl::DeadlineExceededError("the server has sent no frame for 200ms"));
}

}  // namespace
}  // namespace liquidblend::cli
