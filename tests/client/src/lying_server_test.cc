// What the client takes from a server that lies.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "liquidblend/client.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/client/temp_files.h"
#include "tests/core/store/blobs/loopback_listener.h"

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

  grpc::Status StreamFrames(grpc::ServerContext*,
                            grpc::ServerReaderWriter<v1::StreamFramesResponse,
                                                     v1::StreamFramesRequest>* stream) override {
    v1::StreamFramesResponse response;
    response.mutable_frame()->set_data(std::string(size_t{65} << 20, 'a'));
    stream->Write(response);
    return grpc::Status::OK;
  }

  // Pages of `num_items`, each of which names itself as the next one. A single item is larger than
  // a page may be.
  grpc::Status ListAnimations(grpc::ServerContext*, const v1::ListAnimationsRequest* request,
                              v1::ListAnimationsResponse* page) override {
    page->set_next_page_token("again");
    for (int k = 0; k < num_items; ++k) page->add_animations();
    if (num_items == 1) page->mutable_animations(0)->set_name(std::string(size_t{17} << 20, 'a'));
    ++num_pages;
    num_asked_for = request->page_size();
    return grpc::Status::OK;
  }

  // Files lie at `url`.
  grpc::Status PresignDownload(grpc::ServerContext*, const v1::PresignDownloadRequest*,
                               v1::PresignDownloadResponse* response) override {
    response->set_url(url);
    response->set_size_bytes(1);
    return grpc::Status::OK;
  }

  grpc::Status PresignUpload(grpc::ServerContext*, const v1::PresignUploadRequest* request,
                             v1::PresignUploadResponse* response) override {
    for (const v1::PresignUploadRequest::File& file : request->files()) {
      v1::PresignUploadResponse::File& urls = *response->add_files();
      urls.add_part_urls(url);
      urls.set_part_bytes(file.size_bytes());
    }
    return grpc::Status::OK;
  }

  // Pages without end.
  grpc::Status ListFamilies(grpc::ServerContext*, const v1::ListFamiliesRequest*,
                            v1::ListFamiliesResponse* page) override {
    page->set_next_page_token(absl::StrCat(++num_pages));
    return grpc::Status::OK;
  }

  std::atomic<int> num_pages = 0;
  std::atomic<int> num_items = 0;  // of a page
  std::atomic<int> num_asked_for = 0;
  std::string url;
};

class LyingServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    client_ = Connect(absl::StrCat("127.0.0.1:", port_));
    ASSERT_NE(client_, nullptr);
  }

  static std::unique_ptr<Client> Connect(const std::string& target) {
    ConnectOptions options;
    options.target = target;
    options.retry.max_attempts = 1;
    auto client = Client::Connect(options);
    EXPECT_TRUE(client.ok()) << client.status();
    return client.ok() ? *std::move(client) : nullptr;
  }

  // How many of a download and an upload by `client` have connected to a url of this machine.
  int NumConnectionsOfTransfers(Client& client) {
    store::LoopbackListener host;
    service_.url = absl::StrCat("http://127.0.0.1:", host.port(), "/");
    std::atomic<int> num_connections = 0;
    std::thread accepting([&] {
      for (int socket; (socket = host.Accept()) >= 0; ++num_connections) close(socket);
    });
    EXPECT_FALSE(client.Download("animations/water", dir_.File("water")).ok());
    UploadRequest upload;
    upload.animation = "water";
    upload.files = {dir_.Write("f_0001.ply", "ply")};
    EXPECT_FALSE(client.UploadAnimation(upload).ok());
    host.Shutdown();
    accepting.join();
    return num_connections;
  }

  void TearDown() override {
    client_ = nullptr;
    server_->Shutdown();
  }

  const testing::TempDir dir_;
  int port_ = 0;
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
  StreamSettings settings;
  settings.family = "water";
  const auto stream = client_->StreamFrames(settings);
  ASSERT_TRUE(stream.ok()) << stream.status();
  EXPECT_TRUE((*stream)->Read().ok());
}

TEST_F(LyingServerTest, ListsThatDoNotEndAreLeft) {
  const absl::Status again = client_->ListAnimations().status();
  EXPECT_EQ(again.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(again.message(), HasSubstr("does not end"));
  EXPECT_EQ(service_.num_pages, 2);
  EXPECT_EQ(client_->ListFamilies().status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(LyingServerTest, PagesAreBounded) {
  service_.num_items = 1;
  EXPECT_EQ(client_->ListAnimations().status().code(), absl::StatusCode::kResourceExhausted);
  service_.num_items = service_.num_asked_for + 1;
  const absl::Status status = client_->ListAnimations().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), HasSubstr("more items on a page"));
}

TEST_F(LyingServerTest, AServerElsewhereHasNothingSentToThisMachine) {
  EXPECT_EQ(NumConnectionsOfTransfers(*client_), 2) << "that of this machine may";
  // One of its addresses is of no machine at all.
  const std::unique_ptr<Client> client = Connect(absl::StrCat("127.0.0.1:", port_, ",192.0.2.1:1"));
  ASSERT_NE(client, nullptr);
  EXPECT_EQ(NumConnectionsOfTransfers(*client), 0);
}

// It says in HTTP/2 that a connection may have no stream, so that calls do not begin.
TEST(StillServer, AStreamThatCannotBeginEnds) {
  using std::string_literals::operator""s;
  const std::string settings = "\0\0\6\4\0\0\0\0\0"s + "\0\3\0\0\0\0"s;  // MAX_CONCURRENT_STREAMS 0
  const std::string acknowledgement = "\0\0\0\4\1\0\0\0\0"s;
  store::LoopbackListener listener;
  std::vector<std::thread> connections;
  std::thread accepting([&] {
    for (int socket; (socket = listener.Accept()) >= 0;) {
      connections.emplace_back([=] {
        const std::string bytes = settings + acknowledgement;
        send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        char buffer[4096];
        while (recv(socket, buffer, sizeof(buffer), 0) > 0) {
        }
        close(socket);
      });
    }
  });
  {
    ConnectOptions options;
    options.target = absl::StrCat("127.0.0.1:", listener.port());
    options.call_timeout = absl::Milliseconds(200);
    options.retry.max_attempts = 1;
    options.retry.patience = absl::ZeroDuration();
    const auto client = Client::Connect(options);
    ASSERT_TRUE(client.ok()) << client.status();
    StreamSettings stream_settings;
    stream_settings.family = "water";
    const auto stream = (*client)->StreamFrames(stream_settings);
    EXPECT_TRUE(!stream.ok() || !(*stream)->Read().ok());
  }
  listener.Shutdown();
  accepting.join();
  for (std::thread& connection : connections) connection.join();
}

}  // namespace
}  // namespace liquidblend
