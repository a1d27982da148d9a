#include <filesystem>
#include <fstream>

#include "google/rpc/error_details.pb.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

using google::rpc::ErrorInfo;

class ImportAnimationTest : public ServerTest {
 protected:
  void SetUp() override {
    const std::string root = folder_.path() + "/sims";
    std::filesystem::create_directories(root + "/shot");
    std::ofstream(root + "/shot/f1.ply") << "one";
    std::ofstream(root + "/shot/f2.ply") << "two two";
    ServerOptions options;
    options.import_roots = {{"sims", root}};
    Start(options);
  }

  grpc::Status Import(const std::string& id, const std::string& location,
                      const std::string& request_id = "") {
    grpc::ClientContext context;
    v1::ImportAnimationRequest request;
    request.set_animation_id(id);
    request.set_location(location);
    request.set_request_id(request_id);
    request.mutable_options()->set_frames_per_second(30);
    return stub_->ImportAnimation(&context, request, &operation_);
  }

  Operation operation_;
};

TEST_F(ImportAnimationTest, EnqueuesTheJobThatAnUploadWould) {
  ASSERT_THAT(Import("drop", "sims/shot", "once"), IsOk());
  const std::string first = operation_.name();
  ASSERT_THAT(Import("drop", "sims/shot", "once"), IsOk());
  EXPECT_EQ(operation_.name(), first);
  const store::pb::ImportJob job = TakeJob().job.import_animation();
  EXPECT_EQ(job.animation(), "drop");
  EXPECT_EQ(job.options().frames_per_second(), 30);
  ASSERT_EQ(job.files_size(), 2);
  EXPECT_EQ(job.files(1).name(), "f2.ply");
  const auto blob = blobs_->Open(job.files(1).blob());
  ASSERT_TRUE(blob.ok()) << blob.status();
  EXPECT_EQ((*blob)->bytes().size(), 7U);
}

TEST_F(ImportAnimationTest, RefusalsNameTheFieldAndLeaveNothingVisible) {
  EXPECT_THAT(Import("NO", "sims/shot"), EndsWith(grpc::StatusCode::INVALID_ARGUMENT,
                                                  "animation_id: must be animations/NAME"));
  EXPECT_THAT(Import("drop", "sims/../shot"),
              EndsWith(grpc::StatusCode::INVALID_ARGUMENT, "location: "));
  const grpc::Status unknown = Import("drop", "other/shot");
  EXPECT_THAT(unknown, EndsWith(grpc::StatusCode::NOT_FOUND, "no import root 'other'"));
  EXPECT_EQ(DetailOf<ErrorInfo>(unknown).reason(), "IMPORT_ROOT_UNKNOWN");
  for (const char* name : {"f3", "f4", "f5"}) {
    std::ofstream(folder_.path() + "/sims/shot/" + name + ".ply") << "more";
  }
  const grpc::Status many = Import("drop", "sims/shot");
  EXPECT_EQ(DetailOf<ErrorInfo>(many).reason(), "TOO_MANY_FILES");
  EXPECT_TRUE(catalog_->ListAnimations(10, "")->records.empty());
  EXPECT_TRUE(catalog_->ListJobs(10, "")->records.empty());
}

}  // namespace
}  // namespace liquidblend::server
