// A store without room: what comes in is refused by name, what is there is served.
#include <gmock/gmock.h>

#include "tests/client/run_command.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using liquidblend::testing::CommandResult;
using ::testing::AllOf;
using ::testing::HasSubstr;

class RoomTest : public E2eTest {
 protected:
  CommandResult Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"--server", Address()});
    return liquidblend::testing::RunLiquidblend(arguments);
  }

  // Two balls, and a family of them.
  void FillStore() {
    const Process server = StartServer(/*num_workers=*/1);
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 2.0).name()));
    Operation operation;
    ASSERT_TRUE(Register(1, operation).ok());
    ExpectSuccess(AwaitDone(operation.name()));
  }

  void ExpectServesButAcceptsNothing(const std::string& reason) {
    Operation operation;
    const grpc::Status upload = Upload("c", BallFiles(1.0), "", operation);
    EXPECT_EQ(upload.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(upload.error_message(), HasSubstr(reason));
    const grpc::Status registration = Register(2, operation);
    EXPECT_EQ(registration.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_THAT(registration.error_message(), HasSubstr(reason));
    EXPECT_EQ(Run({"inspect", "balls"}).exit_code, 0);
    const std::string file = blob_folder() + "/frame.drc";
    const CommandResult frame = Run({"frame", "balls", "-w", "0.5", "-t", "0.1", "-o", file});
    EXPECT_EQ(frame.exit_code, 0) << frame.err;
  }
};

TEST_F(RoomTest, BelowTheReserveOfTheDiskNothingMoreIsAccepted) {
  FillStore();
  const Process server = StartServer(0, {"LIQUIDBLEND_DISK_RESERVE=1000000TiB"});
  ExpectServesButAcceptsNothing("the disk of '" + data());
}

TEST_F(RoomTest, BeyondWhatAllOwnersMayStoreNothingMoreIsAccepted) {
  FillStore();
  Process full = StartServer(0, {"LIQUIDBLEND_MAX_STORED=1KiB"});
  ExpectServesButAcceptsNothing("all owners together may have 1024 bytes stored and have ");
  full.Signal(SIGTERM);
  EXPECT_EQ(full.Wait(), 0);
  const Process roomy = StartServer(0, {"LIQUIDBLEND_MAX_STORED=1GiB"});
  Operation operation;
  EXPECT_TRUE(Upload("c", BallFiles(1.0), "", operation).ok());
}

}  // namespace
}  // namespace liquidblend::e2e
