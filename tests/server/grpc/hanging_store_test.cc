// While the object store hangs, whatever does not need it is answered at once.
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/server/grpc/server_testing.h"
#include "tests/server/hanging_blobs.h"

namespace liquidblend::server::hanging_store_test {
namespace {

constexpr int kNumThreads = 2;  // of the server, for the catalog and for blobs

void SetDeadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
}

class HangingStoreTest : public ServerTest {
 protected:
  void SetUp() override {
    PublishSplash();
    std::filesystem::create_directories(folder_.path() + "/sims/shot");
    std::ofstream(folder_.path() + "/sims/shot/f1.ply") << "abc";
    ServerOptions options;
    options.num_io_threads = kNumThreads;
    options.import_roots = {{"sims", folder_.path() + "/sims"}};
    Start(options);
  }
  ~HangingStoreTest() override {
    hanging_.Release();
    for (std::thread& call : calls_) call.join();
    server_.reset();
  }

  store::BlobStore& served_blobs() override { return hanging_; }

  // More calls than there are threads, all of which hang.
  void HangIn(const std::function<void(grpc::ClientContext&, int)>& call) {
    for (int k = 0; k < 3 * kNumThreads; ++k) {
      calls_.emplace_back([call, k] {
        grpc::ClientContext context;
        SetDeadline(context);
        call(context, k);
      });
    }
    EXPECT_TRUE(hanging_.AwaitHanging(kNumThreads));
  }

  void ExpectThatTheRestIsAnswered() {
    grpc::ClientContext list;
    SetDeadline(list);
    v1::ListFamiliesResponse families;
    EXPECT_THAT(stub_->ListFamilies(&list, {}, &families), IsOk());
    EXPECT_EQ(families.families_size(), 1);
    grpc::ClientContext get;
    SetDeadline(get);
    v1::GetFamilyRequest request;
    request.set_name("families/splash");
    v1::Family family;
    EXPECT_THAT(stub_->GetFamily(&get, request, &family), IsOk());
    grpc::ClientContext jobs;
    SetDeadline(jobs);
    google::longrunning::ListOperationsResponse operations;
    EXPECT_THAT(operations_->ListOperations(&jobs, {}, &operations), IsOk());
    ExpectThatHttpIsAnswered();
  }

  // GET /v1/families
  void ExpectThatHttpIsAnswered() {
    absl::Notification is_answered;
    server_->api().Call(
        kListFamilies, {}, [](google::protobuf::Message&) { return absl::OkStatus(); },
        [] { return true; },
        [&](const absl::StatusOr<MessagePtr>& response) {
          EXPECT_TRUE(response.ok()) << response.status();
          is_answered.Notify();
        });
    EXPECT_TRUE(is_answered.WaitForNotificationWithTimeout(absl::Seconds(20)));
    if (!is_answered.HasBeenNotified()) hanging_.Release();
    is_answered.WaitForNotification();  // it is the callback's
  }

  // An upload of one file of three bytes.
  void Upload(grpc::ClientContext& context, const std::string& id, const std::string& blob = "") {
    Operation operation;
    auto writer = stub_->UploadAnimation(&context, &operation);
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id(id);
    writer->Write(message);
    message.mutable_file()->set_name("f1.ply");
    message.mutable_file()->set_size_bytes(3);
    message.mutable_file()->set_blob(blob);
    writer->Write(message);
    if (blob.empty()) {
      message.set_chunk("abc");
      writer->Write(message);
    }
    writer->WritesDone();
    writer->Finish();
  }

  HangingBlobs hanging_{*blobs_};
  std::vector<std::thread> calls_;
};

TEST_F(HangingStoreTest, FilesOfUploadsHoldUpNobodyElse) {
  hanging_.Hang();
  HangIn([this](grpc::ClientContext& context, int k) { Upload(context, absl::StrCat("drop", k)); });
  ExpectThatTheRestIsAnswered();
}

TEST_F(HangingStoreTest, FilesThatWereSentDirectlyHoldUpNobodyElse) {
  hanging_.Hang();
  HangIn([this](grpc::ClientContext& context, int k) {
    const std::string blob =
        absl::StrCat("sha256-", std::string(64, 'a'), "-", std::string(32, '0'));
    Upload(context, absl::StrCat("drop", k), blob);
  });
  ExpectThatTheRestIsAnswered();
}

TEST_F(HangingStoreTest, SignedUrlsHoldUpNobodyElse) {
  hanging_.Hang();
  HangIn([this](grpc::ClientContext& context, int) {
    v1::PresignDownloadRequest request;
    request.set_name("families/splash");
    v1::PresignDownloadResponse response;
    stub_->PresignDownload(&context, request, &response);
  });
  ExpectThatTheRestIsAnswered();
}

TEST_F(HangingStoreTest, UrlsForUploadsHoldUpNobodyElse) {
  hanging_.Hang();
  HangIn([this](grpc::ClientContext& context, int) {
    v1::PresignUploadRequest request;
    request.add_files()->set_size_bytes(3);
    request.mutable_files(0)->set_checksum("sha256-" + std::string(64, 'a'));
    v1::PresignUploadResponse response;
    stub_->PresignUpload(&context, request, &response);
  });
  ExpectThatTheRestIsAnswered();
}

TEST_F(HangingStoreTest, ImportsHoldUpNobodyElse) {
  hanging_.Hang();
  HangIn([this](grpc::ClientContext& context, int k) {
    v1::ImportAnimationRequest request;
    request.set_animation_id(absl::StrCat("drop", k));
    request.set_location("sims/shot");
    Operation operation;
    stub_->ImportAnimation(&context, request, &operation);
  });
  ExpectThatTheRestIsAnswered();
}

// One file was stored when the client went away.
TEST_F(HangingStoreTest, FilesThatAreDeletedHoldUpNobodyElse) {
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientWriter<v1::UploadAnimationRequest>>> uploads;
  std::vector<Operation> operations(3 * kNumThreads);
  for (int k = 0; k < 3 * kNumThreads; ++k) {
    auto& context = *contexts.emplace_back(std::make_unique<grpc::ClientContext>());
    auto& upload = *uploads.emplace_back(stub_->UploadAnimation(&context, &operations[k]));
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id(absl::StrCat("drop", k));
    upload.Write(message);
    message.mutable_file()->set_name("f1.ply");
    upload.Write(message);
  }
  const absl::Time give_up = absl::Now() + absl::Seconds(20);
  while (blobs_->List()->size() < 1U + 3 * kNumThreads) ASSERT_LT(absl::Now(), give_up);
  hanging_.Hang();
  for (size_t k = 0; k < uploads.size(); ++k) {
    contexts[k]->TryCancel();
    uploads[k]->Finish();
  }
  ASSERT_TRUE(hanging_.AwaitHanging(kNumThreads));
  ExpectThatTheRestIsAnswered();
}

TEST_F(HangingStoreTest, OperationsThatAreCancelledHoldUpNobodyElse) {
  std::vector<std::string> names;
  for (int k = 0; k < 3 * kNumThreads; ++k) {
    store::pb::AnimationRecord animation;
    animation.set_id(absl::StrCat("drop", k));
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(animation.id());
    store::pb::SourceFile& file = *job.mutable_import_animation()->add_files();
    file.set_blob((*blobs_->CreateUpload())->Commit().value());
    names.push_back("operations/" + catalog_->SubmitImport(animation, job, {})->id());
  }
  hanging_.Hang();
  for (const std::string& name : names) {
    grpc::ClientContext context;
    SetDeadline(context);
    google::longrunning::CancelOperationRequest request;
    request.set_name(name);
    google::protobuf::Empty empty;
    EXPECT_THAT(operations_->CancelOperation(&context, request, &empty), IsOk());
  }
  ASSERT_TRUE(hanging_.AwaitHanging(kNumThreads));
  ExpectThatTheRestIsAnswered();
}

// The server takes no more from clients than it has room for, and keeps their calls.
TEST_F(HangingStoreTest, UploadsThatWaitForTheStoreAreNotEndedForTheirMemory) {
  constexpr int kNumUploads = 40;
  constexpr int kNumChunks = 32;
  constexpr int64_t kChunk = int64_t{1} << 18;
  ServerOptions options;
  options.listen = "127.0.0.1:0";
  const auto server = *Server::Start(*catalog_, hanging_, families_, options);
  const auto stub = v1::LiquidBlend::NewStub(
      grpc::CreateChannel(server->address(), grpc::InsecureChannelCredentials()));
  absl::Mutex mutex;
  int64_t num_sent = 0;
  hanging_.Hang();
  std::vector<std::thread> uploads;
  for (int k = 0; k < kNumUploads; ++k) {
    uploads.emplace_back([&, k] {
      grpc::ClientContext context;
      Operation operation;
      auto writer = stub->UploadAnimation(&context, &operation);
      v1::UploadAnimationRequest message;
      message.mutable_header()->set_animation_id(absl::StrCat("drop", k));
      writer->Write(message);
      message.mutable_file()->set_name("f1.ply");
      message.mutable_file()->set_size_bytes(kNumChunks * kChunk);
      writer->Write(message);
      message.set_chunk(std::string(kChunk, 'x'));
      for (int i = 0; i < kNumChunks && writer->Write(message); ++i) {
        const absl::MutexLock lock(&mutex);
        num_sent += kChunk;
      }
      writer->WritesDone();
      EXPECT_THAT(writer->Finish(), IsOk());
    });
  }
  // Until no write ends any more: the server's windows are full.
  for (bool goes_on = true; goes_on;) {
    const absl::MutexLock lock(&mutex);
    const auto has_more = [&num_sent, before = num_sent] { return num_sent != before; };
    goes_on = mutex.AwaitWithTimeout(absl::Condition(&has_more), absl::Milliseconds(300));
  }
  hanging_.Release();
  for (std::thread& upload : uploads) upload.join();
  EXPECT_EQ(num_sent, kNumUploads * kNumChunks * kChunk);
}

}  // namespace
}  // namespace liquidblend::server::hanging_store_test
