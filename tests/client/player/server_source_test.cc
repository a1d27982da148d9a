#include "client/player/server_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/client/fake_server.h"

namespace liquidblend::player {
namespace {

using testing::FakeServer;
using ::testing::HasSubstr;
using ::testing::Not;

class ServerSourceTest : public ::testing::Test {
 protected:
  ServerSourceTest() {
    ConnectOptions options;
    options.target = server_.target();
    auto source = ServerSource::Open(options, "drops", 0);
    EXPECT_TRUE(source.ok()) << source.status();
    if (source.ok()) source_ = *std::move(source);
    spec_.blend.weights = {0.5};
    spec_.time_s = 0.25;
  }

  absl::Status Get() { return source_->Get(spec_, *pool_, mesh_, cost_); }

  FakeServer server_;
  std::unique_ptr<ServerSource> source_;
  const std::shared_ptr<FramePool> pool_ = std::make_shared<FramePool>(Allocator());
  FrameSpec spec_;
  FrameMesh mesh_{Allocator()};
  FrameCost cost_;
};

TEST_F(ServerSourceTest, AsksForFramesOfTheVersionThatItHasFound) {
  ASSERT_NE(source_, nullptr);
  EXPECT_EQ(source_->facts().targets.size(), 1u);
  ASSERT_TRUE(Get().ok());
  EXPECT_THAT(server_.LastRequest(), HasSubstr("version: 3"));
  EXPECT_THAT(server_.LastRequest(), HasSubstr("format: MESHOPT"));
  EXPECT_EQ(mesh_.num_triangles(), 8u);
  EXPECT_EQ(mesh_.facts.time_s, 0.25);
  EXPECT_GT(cost_.num_bytes, 0);
}

TEST_F(ServerSourceTest, AnOlderServerIsAskedForDraco) {
  ASSERT_NE(source_, nullptr);
  server_.FailNext("GetFrame", 1, absl::InvalidArgumentError("encoding.format: unknown format 4"));
  ASSERT_TRUE(Get().ok());
  EXPECT_THAT(server_.LastRequest(), Not(HasSubstr("MESHOPT")));
  ASSERT_TRUE(Get().ok());
  EXPECT_EQ(server_.NumCalls("GetFrame"), 3) << "it is remembered";
}

TEST_F(ServerSourceTest, LeavesRetriesToThePlayer) {
  ASSERT_NE(source_, nullptr);
  server_.FailNext("GetFrame", 1, absl::UnavailableError("away"));
  EXPECT_TRUE(absl::IsUnavailable(Get()));
  EXPECT_EQ(server_.NumCalls("GetFrame"), 1);
}

TEST_F(ServerSourceTest, AFamilyWithoutAVersionIsNamed) {
  ConnectOptions options;
  options.target = server_.target();
  const absl::Status status = ServerSource::Open(options, "empty", 0).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("families/empty"));
}

}  // namespace
}  // namespace liquidblend::player
