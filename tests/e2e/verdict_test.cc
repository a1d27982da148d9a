// Registrations whose animations have too little in common, as a pipeline meets them.
#include "google/rpc/error_details.pb.h"
#include "tests/e2e/e2e_testing.h"
#include "tests/synthetic/shapes.h"
#include "tests/worker/ingest/formats/encode_files.h"

namespace liquidblend::e2e {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kTooDifferent = 6;  // the exit status

class VerdictTest : public E2eTest {
 protected:
  VerdictTest() : server_(StartServer(1)) {
    ExpectSuccess(AwaitDone(ImportBall("a", 1.0).name()));
    ExpectSuccess(AwaitDone(ImportBall("b", 1.1).name()));
    ExpectSuccess(AwaitDone(ImportFarBall().name()));
  }

  // A ball at rest, many of its diameters from the others.
  Operation ImportFarBall() {
    synthetic::MovingSphereOptions options;
    options.centre_m = {10'000, 10'000, 10'000};
    options.num_frames = 6;
    options.subdivisions = 2;
    std::vector<NamedBytes> files;
    for (const ingest::LoadedFile& file :
         ingest::Files(synthetic::MovingSphere(options), ingest::Format::kPly)) {
      files.push_back({file.name, store::AsString(file.bytes)});
    }
    Operation operation;
    const grpc::Status status = Upload("far", files, "", operation);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return operation;
  }

  // Returns the exit status.
  int RunRegister(const std::string& target, const std::vector<std::string>& flags = {}) {
    std::vector<std::string> arguments = {"--server", Address(),  "register", "balls",
                                          "--source", "a",        "--target", target,
                                          "--wait",   "--levels", "0"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return Process("liquidblend", arguments).Wait();
  }
  int RunOperationsWait(const Operation& operation) {
    return Process("liquidblend", {"--server", Address(), "operations", operation.name(), "--wait"})
        .Wait();
  }

  // The output.
  std::string Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--server", Address()});
    Process program("liquidblend", arguments);
    std::string text;
    for (std::string line = program.ReadLine(); !line.empty(); line = program.ReadLine()) {
      text += line + "\n";
    }
    return text;
  }

  Operation NewestOperation() {
    grpc::ClientContext context;
    google::longrunning::ListOperationsResponse response;
    EXPECT_TRUE(operations_->ListOperations(&context, {}, &response).ok());
    return response.operations(0);
  }
  static v1::RegisterFamilyMetadata MetadataOf(const Operation& operation) {
    v1::RegisterFamilyMetadata metadata;
    EXPECT_TRUE(operation.metadata().UnpackTo(&metadata));
    return metadata;
  }
  v1::Family GetFamily() {
    grpc::ClientContext context;
    v1::GetFamilyRequest request;
    request.set_name("families/balls");
    v1::Family family;
    EXPECT_TRUE(stub_->GetFamily(&context, request, &family).ok());
    return family;
  }

  Process server_;
};

TEST_F(VerdictTest, AnimationsThatAreTooDifferentHaveAnExitStatusOfTheirOwn) {
  EXPECT_EQ(RunRegister("far"), kTooDifferent);
  EXPECT_EQ(GetFamily().version(), 1);
  const Operation operation = NewestOperation();
  EXPECT_EQ(MetadataOf(operation).grade(), v1::Verdict::TOO_DIFFERENT);
  EXPECT_EQ(RunOperationsWait(operation), kTooDifferent);
  EXPECT_EQ(RunRegister("b", {"--replace"}), 0);
  EXPECT_NE(MetadataOf(NewestOperation()).grade(), v1::Verdict::TOO_DIFFERENT);
  EXPECT_EQ(RunOperationsWait(operation), kTooDifferent);  // whatever came after it
}

TEST_F(VerdictTest, ARequiredGradeKeepsTheVersionBefore) {
  EXPECT_EQ(RunRegister("b", {"--require", "doubtful"}), 0);
  EXPECT_EQ(RunRegister("far", {"--replace", "--require", "doubtful"}), kTooDifferent);
  const Operation refused = NewestOperation();
  EXPECT_EQ(refused.error().code(), static_cast<int>(grpc::StatusCode::FAILED_PRECONDITION));
  EXPECT_THAT(refused.error().message(), HasSubstr("'far': the verdict is too different"));
  google::rpc::ErrorInfo info;
  ASSERT_EQ(refused.error().details_size(), 1);
  ASSERT_TRUE(refused.error().details(0).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "VERDICT_TOO_LOW");
  EXPECT_EQ(RunOperationsWait(refused), kTooDifferent);
  EXPECT_EQ(GetFamily().version(), 1);
  EXPECT_EQ(GetFamily().targets(0), "animations/b");
}

TEST_F(VerdictTest, AFailedRegistrationIsToldWhereverItsFamilyIs) {
  EXPECT_EQ(RunRegister("far", {"--require", "good"}), kTooDifferent);
  const Operation failed = NewestOperation();
  EXPECT_EQ(GetFamily().failed_registration().operation(), failed.name());
  EXPECT_TRUE(GetFamily().failed_registration().has_end_time());
  EXPECT_THAT(Run({"list"}), HasSubstr("the verdict is too different"));
  EXPECT_THAT(Run({"inspect", "families/balls"}),
              AllOf(HasSubstr("no version; its registration failed at 20"),
                    HasSubstr("the verdict is too different"), Not(HasSubstr("bounds"))));
  EXPECT_THAT(Run({"operations", failed.name(), "--wait"}),
              AllOf(HasSubstr(", began at 20"), HasSubstr(", worker "),
                    HasSubstr("the verdict is too different")));
  EXPECT_EQ(RunRegister("b"), 0);  // the name has no version yet
  EXPECT_FALSE(GetFamily().has_failed_registration());
  EXPECT_THAT(Run({"operations", NewestOperation().name(), "--wait"}),
              AllOf(HasSubstr(" s, worker "), HasSubstr(", version 1, verdict ")));
}

TEST_F(VerdictTest, ACancelledRegistrationIsToldWhereverItsFamilyIs) {
  Operation registration;
  ASSERT_TRUE(Register(LongWork(), registration).ok());
  EXPECT_THAT(Run({"cancel", registration.name()}), HasSubstr("cancelled"));
  AwaitDone(registration.name());
  EXPECT_EQ(GetFamily().failed_registration().error().code(),
            static_cast<int>(grpc::StatusCode::CANCELLED));
  EXPECT_THAT(Run({"list"}), HasSubstr("cancelled at 20"));
  EXPECT_THAT(Run({"inspect", "families/balls"}), HasSubstr("its registration cancelled at 20"));
  EXPECT_THAT(Run({"operations", registration.name()}), HasSubstr(" cancelled "));
}

}  // namespace
}  // namespace liquidblend::e2e
