// The versions of a family that are kept beside the published one, and the way back to them.
#include <csignal>

#include "absl/strings/str_cat.h"
#include "core/store/files/files.h"
#include "tests/client/run_command.h"
#include "tests/e2e/e2e_testing.h"

namespace liquidblend::e2e {
namespace {

using ::testing::HasSubstr;

class KeptVersionsTest : public E2eTest {
 protected:
  KeptVersionsTest() : server_(StartServer(1)) {
    for (const auto& [id, velocity] : {std::pair("a", 1.0), {"b", 2.0}, {"c", 3.0}}) {
      ExpectSuccess(AwaitDone(ImportBall(id, velocity).name()));
    }
  }

  void Publish(const std::string& target) {
    Operation registration;
    const grpc::Status status = Register(1, registration, {target});
    ASSERT_TRUE(status.ok()) << status.error_message();
    ExpectSuccess(AwaitDone(registration.name()));
  }

  grpc::Status GetFrame(int64_t version, v1::Frame& frame) {
    grpc::ClientContext context;
    v1::GetFrameRequest request;
    request.set_family("families/balls");
    request.add_weights(1.0);
    request.set_time_s(0.1);
    request.set_version(version);
    return stub_->GetFrame(&context, request, &frame);
  }
  v1::Frame MustGetFrame(int64_t version) {
    v1::Frame frame;
    const grpc::Status status = GetFrame(version, frame);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return frame;
  }

  v1::Family GetFamily() {
    grpc::ClientContext context;
    v1::GetFamilyRequest request;
    request.set_name("families/balls");
    v1::Family family;
    EXPECT_TRUE(stub_->GetFamily(&context, request, &family).ok());
    return family;
  }

  int Rollback(int64_t version) {
    return Process("liquidblend",
                   {"--server", Address(), "rollback", "balls", std::to_string(version)})
        .Wait();
  }

  Process server_;
};

TEST_F(KeptVersionsTest, TheOneBeforeIsKeptAndOneCommandGoesBack) {
  Publish("b");
  const v1::Frame first = MustGetFrame(0);
  Publish("c");
  const v1::Frame second = MustGetFrame(0);
  EXPECT_EQ(second.version(), 2);
  EXPECT_NE(first.data(), second.data());
  EXPECT_EQ(MustGetFrame(1).data(), first.data());
  v1::Family family = GetFamily();
  ASSERT_EQ(family.kept_versions_size(), 1);
  EXPECT_EQ(family.kept_versions(0).version(), 1);
  EXPECT_EQ(family.kept_versions(0).targets(0), "animations/b");
  EXPECT_GT(family.kept_versions(0).size_bytes(), 0);
  EXPECT_LT(family.kept_versions(0).publish_time().seconds(), family.update_time().seconds() + 1);

  EXPECT_EQ(Rollback(1), 0);
  const v1::Frame back = MustGetFrame(0);
  EXPECT_EQ(back.version(), 3);
  EXPECT_EQ(back.data(), first.data());
  EXPECT_EQ(MustGetFrame(2).data(), second.data());
  v1::Frame none;
  const grpc::Status gone = GetFrame(1, none);
  EXPECT_EQ(gone.error_code(), grpc::StatusCode::NOT_FOUND);
  family = GetFamily();
  EXPECT_EQ(family.restored_version(), 1);
  EXPECT_EQ(family.targets(0), "animations/b");
  EXPECT_EQ(Rollback(7), 4);
  EXPECT_EQ(GetFamily().version(), 3);
}

// Each command is a client of its own.
TEST_F(KeptVersionsTest, CommandsThatFollowARegistrationGetItsVersion) {
  const auto run = [this](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", Address(), "--quiet"});
    return liquidblend::testing::RunLiquidblend(arguments);
  };
  std::vector<std::string> registration = {
      "register", "balls", "--source", "a", "--target", "b", "--iterations", "1", "--wait"};
  for (int version = 1; version <= 3; ++version) {
    const auto registered = run(registration);
    ASSERT_THAT(registered.exit_code, ::testing::AnyOf(0, 6)) << registered.err;
    const std::string words = absl::StrCat("families/balls version ", version, ",");
    EXPECT_THAT(run({"frame", "balls", "-w", "1", "-t", "0", "-o", data() + "/frame.ply"}).out,
                HasSubstr(words));
    EXPECT_THAT(run({"export", "balls", "-w", "1", "-o", data() + "/out", "--overwrite"}).out,
                HasSubstr(words));
    if (version > 1) continue;
    const auto taken = run(registration);
    EXPECT_EQ(taken.exit_code, 1);
    EXPECT_THAT(taken.err, HasSubstr("exists already"));
    registration.push_back("--replace");
  }
}

// The versions differ in their target, which moves the ball.
TEST_F(KeptVersionsTest, CommandsTakeTheOneThatIsAskedFor) {
  Publish("b");
  Publish("c");
  const auto run = [this](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", Address()});
    return Process("liquidblend", arguments).Wait();
  };
  for (const std::string version : {"1", "2"}) {
    const std::string out = data() + "/export-" + version;
    EXPECT_EQ(run({"export", "balls", "--version", version, "-w", "1", "-o", out}), 0);
    EXPECT_THAT(store::ReadFile(out + "/meta.json"), HasSubstr("\"version\": " + version));
    EXPECT_EQ(run({"stream", "balls", "--version", version, "--seconds", "0.2"}), 0);
    EXPECT_EQ(run({"render", "balls", "--version", version, "--columns", "1", "-w", "1", "--size",
                   "32x24", "-o", data() + "/render-" + version + ".png"}),
              0);
  }
  EXPECT_EQ(run({"export", "balls", "-w", "1", "-o", data() + "/export"}), 0);
  const auto last_frame = [this](const std::string& folder) {
    return store::ReadFile(data() + "/" + folder + "/frame_0006.ply");
  };
  EXPECT_EQ(last_frame("export"), last_frame("export-2"));
  EXPECT_NE(last_frame("export"), last_frame("export-1"));
  EXPECT_NE(store::ReadFile(data() + "/render-1.png"), store::ReadFile(data() + "/render-2.png"));
  EXPECT_EQ(run({"export", "balls", "--version", "7", "-w", "1", "-o", data() + "/none"}), 4);
}

TEST_F(KeptVersionsTest, AServerThatHasJustStartedHasThemToo) {
  if (server_.pid() <= 0) GTEST_SKIP() << "the servers run already";
  Publish("b");
  const v1::Frame first = MustGetFrame(0);
  Publish("c");
  server_.Signal(SIGTERM);
  EXPECT_EQ(server_.Wait(), 0);
  server_ = StartServer();
  EXPECT_EQ(MustGetFrame(1).data(), first.data());
  EXPECT_EQ(MustGetFrame(0).version(), 2);
  EXPECT_EQ(MustGetFrame(1).data(), first.data());
}

TEST_F(KeptVersionsTest, TheirAnimationsCannotBeDeleted) {
  Publish("b");
  Publish("c");
  grpc::ClientContext context;
  v1::DeleteAnimationRequest request;
  request.set_name("animations/b");
  google::protobuf::Empty empty;
  const grpc::Status status = stub_->DeleteAnimation(&context, request, &empty);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(status.error_message(), HasSubstr("is part of family 'balls'"));
}

}  // namespace
}  // namespace liquidblend::e2e
