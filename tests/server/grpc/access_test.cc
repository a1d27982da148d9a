// Who may call what, as clients see it.
#include <fstream>
#include <map>

#include "absl/strings/str_cat.h"
#include "core/base/log.h"
#include "google/rpc/error_details.pb.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using google::rpc::ErrorInfo;
using google::rpc::RetryInfo;
using testing::Pair;
using testing::UnorderedElementsAre;

// One principal for each scope, called like it; "narrow" has them all, and narrow limits.
class AccessTest : public ServerTest {
 protected:
  void SetUp() override {
    std::string entries;
    for (const char* scope : {"frames", "write", "register"}) {
      const NewToken made = *MakeToken(scope, {scope});
      tokens_[scope] = made.token;
      absl::StrAppend(&entries, made.entry, ",");
    }
    NewToken made = *MakeToken("narrow", {"frames", "write", "register"});
    tokens_["narrow"] = made.token;
    made.entry.insert(made.entry.size() - 1,
                      R"(, "limits": {"max_upload_bytes": 10, "max_streams": 1,
                                      "requests_per_second": 3})");
    const std::string path = folder_.path() + "/tokens.json";
    std::ofstream(path) << R"({"principals": [)" << entries << made.entry << "]}";
    ServerOptions options;
    options.authorizer = *Authorizer::Open(path);
    Start(options);
    PublishSplash();
  }

  void Show(const std::string& name, grpc::ClientContext& context) {
    const auto token = tokens_.find(name);
    const std::string shown = token == tokens_.end() ? name : token->second;
    if (!shown.empty()) context.AddMetadata("authorization", absl::StrCat("Bearer ", shown));
  }

  grpc::Status GetFrame(const std::string& as) {
    grpc::ClientContext context;
    Show(as, context);
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    v1::Frame frame;
    return stub_->GetFrame(&context, request, &frame);
  }

  grpc::Status Stream(const std::string& as) {
    grpc::ClientContext context;
    Show(as, context);
    auto stream = stub_->StreamFrames(&context);
    stream->WritesDone();
    v1::StreamFramesResponse response;
    stream->Read(&response);
    return stream->Finish();
  }

  grpc::Status Upload(const std::string& as, int64_t size_bytes) {
    grpc::ClientContext context;
    Show(as, context);
    Operation operation;
    auto writer = stub_->UploadAnimation(&context, &operation);
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id("drop");
    writer->Write(message);
    message.mutable_file()->set_name("f1.ply");
    message.mutable_file()->set_size_bytes(size_bytes);
    writer->Write(message);
    writer->WritesDone();
    return writer->Finish();
  }

  grpc::Status Delete(const std::string& as, const std::string& animation) {
    grpc::ClientContext context;
    Show(as, context);
    v1::DeleteAnimationRequest request;
    request.set_name("animations/" + animation);
    google::protobuf::Empty empty;
    return stub_->DeleteAnimation(&context, request, &empty);
  }

  grpc::Status Register(const std::string& as) {
    grpc::ClientContext context;
    Show(as, context);
    v1::RegisterFamilyRequest request;
    request.set_family_id("other");
    request.set_source("animations/a");
    request.add_targets("animations/b");
    Operation operation;
    return stub_->RegisterFamily(&context, request, &operation);
  }

  grpc::Status List(const std::string& as) {
    grpc::ClientContext context;
    Show(as, context);
    v1::ListFamiliesResponse response;
    return stub_->ListFamilies(&context, {}, &response);
  }

  std::map<std::string, std::string> tokens_;
};

MATCHER_P(Lacks, scope, "") {
  const auto info = DetailOf<ErrorInfo>(arg);
  *result_listener << arg.error_code() << ": " << arg.error_message();
  return arg.error_code() == grpc::StatusCode::PERMISSION_DENIED &&
         info.reason() == "SCOPE_MISSING" && info.metadata().at("scope") == scope;
}

TEST_F(AccessTest, EachScopeAllowsItsOwnAndNothingElse) {
  EXPECT_THAT(GetFrame("frames"), IsOk());
  EXPECT_THAT(GetFrame("write"), Lacks("frames"));
  EXPECT_THAT(Stream("register"), Lacks("frames"));
  EXPECT_THAT(Upload("write", 0), IsOk());
  EXPECT_THAT(Upload("frames", 0), Lacks("write"));
  EXPECT_THAT(Delete("register", "a"), Lacks("write"));
  EXPECT_THAT(Register("frames"), Lacks("register"));
  EXPECT_THAT(Register("register"), IsOk());
  for (const char* name : {"frames", "write", "register"}) EXPECT_THAT(List(name), IsOk());
}

TEST_F(AccessTest, WithoutAKnownTokenNothingIsAllowedButAskingForHealth) {
  for (const auto& status : {GetFrame(""), Stream(""), Upload("", 0), List("")}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(DetailOf<ErrorInfo>(status).reason(), "TOKEN_MISSING");
  }
  for (const auto& status : {GetFrame("guess"), Stream("guess"), Upload("guess", 0)}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(DetailOf<ErrorInfo>(status).reason(), "TOKEN_UNKNOWN");
  }
  EXPECT_EQ(Health(""), 1);
}

TEST_F(AccessTest, AnUploadIsBoundedByThePrincipalsOwnLimit) {
  EXPECT_EQ(Upload("write", 11).error_code(), grpc::StatusCode::INVALID_ARGUMENT) << "unfinished";
  const grpc::Status status = Upload("narrow", 11);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  const auto info = DetailOf<ErrorInfo>(status);
  EXPECT_EQ(info.reason(), "UPLOAD_TOO_LARGE");
  EXPECT_THAT(info.metadata(),
              UnorderedElementsAre(Pair("limit", "10"), Pair("resource", "animations/drop")));
}

TEST_F(AccessTest, TooManyCallsAreRefusedWithATimeToWait) {
  for (int k = 0; k < 3; ++k) EXPECT_THAT(List("narrow"), IsOk());
  grpc::Status status;
  for (int k = 0; k < 50 && status.ok(); ++k) status = List("narrow");
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailOf<ErrorInfo>(status).reason(), "RATE_LIMITED");
  EXPECT_GT(DetailOf<RetryInfo>(status).retry_delay().nanos(), 0);
  EXPECT_THAT(List("frames"), IsOk());
}

TEST_F(AccessTest, TooManyStreamsAreRefusedUntilOneEnds) {
  const store::pb::JobRecord job = SubmitImport("drop");
  const auto watch = [&](grpc::ClientContext& context) {
    Show("narrow", context);
    v1::WatchOperationRequest request;
    request.set_name("operations/" + job.id());
    return stub_->WatchOperation(&context, request);
  };
  grpc::ClientContext first_context;
  auto first = watch(first_context);
  Operation operation;
  ASSERT_TRUE(first->Read(&operation));
  const grpc::Status refused = Stream("narrow");
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailOf<ErrorInfo>(refused).reason(), "TOO_MANY_STREAMS");
  EXPECT_EQ(DetailOf<RetryInfo>(refused).retry_delay().seconds(), 1);
  ASSERT_TRUE(catalog_->RequestCancel(job.id()).ok());
  while (first->Read(&operation)) {
  }
  EXPECT_THAT(first->Finish(), IsOk());
  grpc::ClientContext second_context;
  auto second = watch(second_context);
  EXPECT_TRUE(second->Read(&operation));
  EXPECT_THAT(second->Finish(), IsOk());
}

TEST_F(AccessTest, ARequestIdIsToldToTheClient) {
  const auto told = [&](const std::string& asked) {
    grpc::ClientContext context;
    Show("frames", context);
    if (!asked.empty()) context.AddMetadata("x-request-id", asked);
    v1::ListFamiliesResponse response;
    EXPECT_THAT(stub_->ListFamilies(&context, {}, &response), IsOk());
    const auto& header = context.GetServerInitialMetadata().find("x-request-id")->second;
    return std::string(header.data(), header.size());
  };
  EXPECT_EQ(told("shot-17.a"), "shot-17.a");
  EXPECT_EQ(told("").size(), 16U);
  EXPECT_EQ(told("two words").size(), 16U) << "not one that could confuse a log";
}

TEST_F(AccessTest, TheLogTellsOfEachCallAndNeverOfATokenOfAnyone) {
  testing::internal::CaptureStderr();
  base::StartLog("server", base::LogLevel::kDebug, base::LogFormat::kJson);
  EXPECT_THAT(GetFrame("frames"), IsOk());
  EXPECT_THAT(GetFrame("write"), Lacks("frames"));
  EXPECT_FALSE(GetFrame("guess").ok());
  server_->Drain(absl::Seconds(10));
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_THAT(log, testing::ContainsRegex("\"level\":\"debug\",\"message\":\"call\",\"method\":"
                                          "\"GetFrame\",\"code\":\"OK\",\"ms\":\"[0-9.]+\","
                                          "\"principal\":\"frames\""));
  EXPECT_THAT(log, testing::HasSubstr("\"code\":\"PERMISSION_DENIED\""));
  EXPECT_THAT(log, testing::HasSubstr("\"resource\":\"families/splash\""));
  EXPECT_THAT(log, testing::HasSubstr("\"code\":\"UNAUTHENTICATED\""));
  EXPECT_THAT(log, testing::Not(testing::HasSubstr("guess")));
  for (const auto& [name, token] : tokens_) {
    EXPECT_THAT(log, testing::Not(testing::HasSubstr(token)));
  }
}

}  // namespace
}  // namespace liquidblend::server
