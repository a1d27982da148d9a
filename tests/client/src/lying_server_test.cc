// What the client takes from a server that lies.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "liquidblend/client.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"

namespace liquidblend {
namespace {

using ::testing::HasSubstr;

class LyingService : public v1::LiquidBlend::Service {
 public:
  // A name of zeros, which gzip makes a thousand times smaller.
  grpc::Status GetFamily(grpc::ServerContext* context, const v1::GetFamilyRequest*,
                         v1::Family* family) override {
    context->set_compression_algorithm(GRPC_COMPRESS_GZIP);
    family->set_name(std::string(size_t{1} << 20, '\0'));
    return grpc::Status::OK;
  }

  grpc::Status GetAnimation(grpc::ServerContext*, const v1::GetAnimationRequest*,
                            v1::Animation* animation) override {
    animation->set_name(std::string(size_t{65} << 20, 'a'));
    return grpc::Status::OK;
  }

  // Frames may be larger.
  grpc::Status GetFrame(grpc::ServerContext*, const v1::GetFrameRequest*,
                        v1::Frame* frame) override {
    frame->set_data(std::string(size_t{65} << 20, 'a'));
    return grpc::Status::OK;
  }

  // Each page names itself as the next one.
  grpc::Status ListAnimations(grpc::ServerContext*, const v1::ListAnimationsRequest*,
                              v1::ListAnimationsResponse* page) override {
    page->set_next_page_token("again");
    ++num_pages;
    return grpc::Status::OK;
  }

  // Pages without end.
  grpc::Status ListFamilies(grpc::ServerContext*, const v1::ListFamiliesRequest*,
                            v1::ListFamiliesResponse* page) override {
    page->set_next_page_token(absl::StrCat(++num_pages));
    return grpc::Status::OK;
  }

  std::atomic<int> num_pages = 0;
};

class LyingServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    ConnectOptions options;
    options.target = absl::StrCat("127.0.0.1:", port);
    auto client = Client::Connect(options);
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }
  void TearDown() override {
    client_ = nullptr;
    server_->Shutdown();
  }

  LyingService service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<Client> client_;
};

TEST_F(LyingServerTest, ACompressedAnswerIsNotDecompressed) {
  EXPECT_FALSE(client_->GetFamily("water").ok());
}

TEST_F(LyingServerTest, AnswersWithoutAFrameAreBounded) {
  EXPECT_EQ(client_->GetAnimation("water").status().code(), absl::StatusCode::kResourceExhausted);
  FrameRequest request;
  request.family = "water";
  EXPECT_TRUE(client_->GetFrame(request).ok());
}

TEST_F(LyingServerTest, ListsThatDoNotEndAreLeft) {
  const absl::Status again = client_->ListAnimations().status();
  EXPECT_EQ(again.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(again.message(), HasSubstr("does not end"));
  EXPECT_EQ(service_.num_pages, 2);
  EXPECT_EQ(client_->ListFamilies().status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace liquidblend
