// What becomes of calls that have begun when the server is told to stop.
#include <thread>

#include "absl/synchronization/notification.h"
#include "tests/core/store/catalog/forwarding_catalog.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server::drain_test {
namespace {

constexpr absl::Duration kPatience = absl::Seconds(20);

// A catalog that keeps whoever asks for a family.
class WaitingCatalog final : public store::ForwardingCatalog {
 public:
  using ForwardingCatalog::ForwardingCatalog;
  absl::StatusOr<store::pb::FamilyRecord> GetFamily(const std::string& id) override {
    if (!is_asked.HasBeenNotified()) is_asked.Notify();
    goes_on.WaitForNotificationWithTimeout(kPatience);
    return ForwardingCatalog::GetFamily(id);
  }
  absl::Notification is_asked, goes_on;
};

TEST_F(ServerTest, AMeasurementThatHasBegunEndsAsItWouldWithoutADrain) {
  PublishSplash();
  WaitingCatalog waiting(*catalog_);
  catalog::Families none_loaded(waiting, *blobs_);
  ServerOptions options;
  options.listen = "127.0.0.1:0";
  const auto server = *Server::Start(waiting, *blobs_, none_loaded, options);
  const auto stub = v1::LiquidBlend::NewStub(
      grpc::CreateChannel(server->address(), grpc::InsecureChannelCredentials()));
  grpc::Status measured;
  v1::MeasureCorrespondencesResponse response;
  std::jthread call([&] {
    grpc::ClientContext context;
    v1::MeasureCorrespondencesRequest request;
    request.set_family("families/splash");
    request.add_correspondences();
    measured = stub->MeasureCorrespondences(&context, request, &response);
  });
  ASSERT_TRUE(waiting.is_asked.WaitForNotificationWithTimeout(kPatience));
  grpc::ClientContext streaming;
  const auto stream = stub->StreamFrames(&streaming);
  std::jthread drain([&] { server->Drain(kPatience); });
  v1::StreamFramesResponse frame;
  EXPECT_FALSE(stream->Read(&frame));  // calls that last end now
  EXPECT_THAT(stream->Finish(), EndsWith(grpc::StatusCode::UNAVAILABLE, "shutting down"));
  waiting.goes_on.Notify();
  call.join();
  EXPECT_THAT(measured, IsOk());
  EXPECT_EQ(response.residuals_size(), 1);
}

}  // namespace
}  // namespace liquidblend::server::drain_test
