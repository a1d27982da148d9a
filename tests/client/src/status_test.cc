#include "client/src/status.h"

#include <gtest/gtest.h>

#include "google/rpc/error_details.pb.h"

namespace liquidblend::client {
namespace {

TEST(FromGrpc, KeepsCodeAndMessage) {
  EXPECT_TRUE(FromGrpc(grpc::Status::OK).ok());
  for (int code = 1; code <= 16; ++code) {
    const absl::Status status = FromGrpc({static_cast<grpc::StatusCode>(code), "why"});
    EXPECT_EQ(static_cast<int>(status.code()), code);
    EXPECT_EQ(status.message(), "why");
  }
}

TEST(FromGrpc, IgnoresDetailsThatAreNoStatus) {
  const absl::Status status = FromGrpc({grpc::StatusCode::INTERNAL, "why", "\xff\xff garbage"});
  EXPECT_EQ(status, absl::InternalError("why"));
}

TEST(FromProto, AReasonThatOnlyRepeatsTheCodeIsLeftOut) {
  google::rpc::Status proto;
  proto.set_code(5);
  proto.set_message("family 'none' does not exist");
  google::rpc::ErrorInfo info;
  info.set_reason("NOT_FOUND");
  proto.add_details()->PackFrom(info);
  EXPECT_EQ(FromProto(proto), absl::NotFoundError("family 'none' does not exist"));
  info.set_reason("FAMILY_EVICTED");
  proto.mutable_details(0)->PackFrom(info);
  EXPECT_EQ(FromProto(proto),
            absl::NotFoundError("family 'none' does not exist; reason: FAMILY_EVICTED"));
}

TEST(FromProto, AnUnknownCodeIsAnUnknownError) {
  google::rpc::Status proto;
  proto.set_code(99);
  proto.set_message("strange");
  EXPECT_EQ(FromProto(proto), absl::UnknownError("strange"));
}

}  // namespace
}  // namespace liquidblend::client
