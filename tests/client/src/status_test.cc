#include "client/src/status.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/src/reason.h"
#include "google/rpc/error_details.pb.h"

namespace liquidblend::client {
namespace {

TEST(FromGrpc, KeepsCodeAndMessage) {
  EXPECT_TRUE(FromGrpc(grpc::Status::OK).ok());
  for (int code = 2; code <= 16; ++code) {
    const absl::Status status = FromGrpc({static_cast<grpc::StatusCode>(code), "why"});
    EXPECT_EQ(static_cast<int>(status.code()), code);
    EXPECT_EQ(status.message(), "why");
  }
}

// As gRPC ends calls that are on their way when a server shuts down: they go to another one.
TEST(FromGrpc, ABareCancellationIsAServerThatIsGone) {
  EXPECT_EQ(FromGrpc({grpc::StatusCode::CANCELLED, "CANCELLED"}),
            absl::UnavailableError("the server has ended the call"));
  google::rpc::Status details;
  details.add_details()->PackFrom(google::rpc::ErrorInfo());
  EXPECT_TRUE(absl::IsCancelled(
      FromGrpc({grpc::StatusCode::CANCELLED, "why", details.SerializeAsString()})));
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
  EXPECT_EQ(FromProto(proto).message(), "family 'none' does not exist");
  EXPECT_EQ(ReasonOf(FromProto(proto)), "NOT_FOUND");
  info.set_reason("FAMILY_EVICTED");
  proto.mutable_details(0)->PackFrom(info);
  EXPECT_EQ(FromProto(proto).message(), "family 'none' does not exist; reason: FAMILY_EVICTED");
  EXPECT_EQ(ReasonOf(FromProto(proto)), "FAMILY_EVICTED");
  proto.clear_details();
  EXPECT_EQ(ReasonOf(FromProto(proto)), "");
}

// Each is looked for in the message, which a server makes as long as it likes.
TEST(FromProto, OfManyDetailsTheFirstAreShown) {
  google::rpc::Status proto;
  proto.set_code(3);
  proto.set_message("why" + std::string(10'000, ' ') + "; late: why");
  google::rpc::BadRequest bad_request;
  for (int k = 0; k < 1000; ++k) {
    auto& violation = *bad_request.add_field_violations();
    violation.set_field(k == 0 ? "late" : absl::StrCat("field ", k));
    violation.set_description("why");
  }
  google::rpc::ErrorInfo info;
  for (int k = 0; k < 1000; ++k) (*info.mutable_metadata())[absl::StrCat("key ", k)] = "value";
  proto.add_details()->PackFrom(bad_request);
  for (int k = 0; k < 1000; ++k) proto.add_details()->PackFrom(info);
  const std::string text(FromProto(proto).message());
  const auto count = [&](const std::string& word) {
    return std::vector<std::string>(absl::StrSplit(text, word)).size() - 1;
  };
  EXPECT_EQ(count("; late: why"), 2) << "the end of the message is not searched";
  EXPECT_EQ(count("field "), 99);
  EXPECT_EQ(count("reason: "), 99);
  EXPECT_EQ(count("key "), 9900);
}

TEST(FromProto, MetadataThatTheMessageHoldsIsNotRepeated) {
  google::rpc::Status proto;
  proto.set_code(5);
  proto.set_message("family 'none' does not exist");
  google::rpc::ErrorInfo info;
  info.set_reason("NOT_FOUND");
  (*info.mutable_metadata())["resource"] = "families/none";
  proto.add_details()->PackFrom(info);
  EXPECT_EQ(FromProto(proto).message(), "family 'none' does not exist");
  (*info.mutable_metadata())["scope"] = "write";
  proto.mutable_details(0)->PackFrom(info);
  EXPECT_EQ(FromProto(proto).message(),
            "family 'none' does not exist; reason: NOT_FOUND (scope=write)");
}

TEST(FromProto, ViolationsThatTheMessageHoldsAreNotRepeated) {
  google::rpc::Status proto;
  proto.set_code(3);
  proto.set_message("source: must be set");
  google::rpc::BadRequest bad_request;
  const auto add = [&](const std::string& field) {
    auto* const violation = bad_request.add_field_violations();
    violation->set_field(field);
    violation->set_description("must be set");
    proto.clear_details();
    proto.add_details()->PackFrom(bad_request);
  };
  add("source");
  EXPECT_EQ(FromProto(proto), absl::InvalidArgumentError("source: must be set"));
  add("targets");
  EXPECT_EQ(FromProto(proto),
            absl::InvalidArgumentError("source: must be set; targets: must be set"));
  add("urce");
  EXPECT_EQ(FromProto(proto),
            absl::InvalidArgumentError("source: must be set; targets: must be set; urce: must be "
                                       "set"));
}

TEST(FromProto, ADelayIsToldAndKept) {
  google::rpc::Status proto;
  proto.set_code(8);
  proto.set_message("too busy");
  google::rpc::RetryInfo info;
  info.mutable_retry_delay()->set_seconds(1);
  info.mutable_retry_delay()->set_nanos(499'100'000);
  proto.add_details()->PackFrom(info);
  const absl::Status busy = FromProto(proto);
  EXPECT_EQ(busy.message(), "too busy; try again in 1.5s");
  EXPECT_EQ(RetryDelay(busy), absl::Microseconds(1'499'100));
  proto.set_code(5);
  EXPECT_EQ(RetryDelay(FromProto(proto)), std::nullopt) << "the same call fails later, too";
  EXPECT_EQ(RetryDelay(absl::ResourceExhaustedError("full")), std::nullopt);
  proto.set_code(8);
  info.mutable_retry_delay()->set_seconds(-5);
  proto.mutable_details(0)->PackFrom(info);
  EXPECT_EQ(RetryDelay(FromProto(proto)), absl::ZeroDuration());
}

TEST(FromProto, AnUnknownCodeIsAnUnknownError) {
  google::rpc::Status proto;
  proto.set_code(99);
  proto.set_message("strange");
  EXPECT_EQ(FromProto(proto), absl::UnknownError("strange"));
}

}  // namespace
}  // namespace liquidblend::client
