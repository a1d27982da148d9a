// Whatever numbers come in the place of the right ones, the server says what is wrong with them,
// and neither computes nor keeps anything for those who sent them.
#include <set>

#include "absl/strings/str_cat.h"
#include "tests/server/rpc/extremes.h"
#include "tests/server/rpc/seeds.h"
#include "tests/server/rpc/server_testing.h"

namespace liquidblend::rpc {
namespace {

// The server's own mistakes; and what the client would hear of one that hangs or has gone.
const std::set<grpc::StatusCode> kFaults = {
    grpc::StatusCode::INTERNAL, grpc::StatusCode::UNKNOWN, grpc::StatusCode::DATA_LOSS,
    grpc::StatusCode::DEADLINE_EXCEEDED, grpc::StatusCode::UNAVAILABLE};

class ExtremesTest : public ServerTest {
 protected:
  void SetUp() override {
    ServerTest::SetUp();
    ImportAnimation("a");
    ImportAnimation("b");
    PublishFamily("splash", "a", "b", 1, {{"h"}, {{0.0}, {1.0}}});
  }

  static std::unique_ptr<Message> NewRequest(const MethodDescriptor& method) {
    return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()
                                        ->GetPrototype(method.input_type())
                                        ->New());
  }

  // The seeds with one number replaced: in the first message that has the field's group.
  static std::vector<std::string> WithExtreme(const MethodDescriptor& method, const FieldPath& path,
                                              size_t number, std::string& value) {
    std::vector<std::string> messages = SeedsOf(method);
    const std::unique_ptr<Message> request = NewRequest(method);
    size_t chosen = 0;
    for (size_t k = messages.size(); k-- > 0;) {
      EXPECT_TRUE(request->ParseFromString(messages[k]));
      const auto* reflection = request->GetReflection();
      const bool has_field = path[0]->is_repeated() ? reflection->FieldSize(*request, path[0]) > 0
                                                    : reflection->HasField(*request, path[0]);
      if (has_field) chosen = k;
    }
    EXPECT_TRUE(request->ParseFromString(messages[chosen]));
    ExcludeOther(*request, path[0]->name());
    value = SetExtreme(*request, path, number);
    messages[chosen] = request->SerializeAsString();
    return messages;
  }

  // Weights and parameters exclude one another.
  static void ExcludeOther(Message& request, const std::string& field) {
    const char* const other = field == "parameters" ? "weights" : "parameters";
    if (const FieldDescriptor* found = request.GetDescriptor()->FindFieldByName(other)) {
      request.GetReflection()->ClearField(&request, found);
    }
  }

  bool ServesFrames() {
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    v1::Frame frame;
    grpc::ClientContext context;
    return stub_->GetFrame(&context, request, &frame).ok();
  }
};

TEST_F(ExtremesTest, EveryNumberOfEveryRequestMayBeAnything) {
  const int64_t before = ResidentBytes();
  int num_calls = 0;
  for (const MethodDescriptor* method : AllMethods()) {
    for (const FieldPath& path : NumericFieldsOf(*method->input_type())) {
      for (size_t k = 0; k < NumExtremesOf(path); ++k) {
        std::string value;
        const auto messages = WithExtreme(*method, path, k, value);
        const grpc::Status status = CallInBytes(channel_, PathOf(*method), messages);
        EXPECT_FALSE(kFaults.contains(status.error_code()))
            << method->name() << " " << NameOf(path) << " = " << value << ": "
            << status.error_code() << " " << status.error_message();
        ++num_calls;
      }
    }
  }
  EXPECT_GT(num_calls, 500);
  EXPECT_LT(ResidentBytes() - before, kMaxGrowthBytes);
  EXPECT_LT(IdleCpuTime(), kMaxIdleCpu);
  EXPECT_TRUE(ServesFrames());
}

// One frame, then nothing for a long time: unless the number changes that.
v1::StreamFramesRequest HeldStream() {
  v1::StreamFramesRequest request;
  request.set_family("families/splash");
  request.add_weights(0.5);
  request.set_rate(0);
  request.set_frames_per_second(0.001);
  return request;
}

using OpenStream = grpc::ClientReaderWriter<v1::StreamFramesRequest, v1::StreamFramesResponse>;

TEST_F(ExtremesTest, StreamsThatStayOpenCostNothing) {
  struct Opened {
    std::string what;
    grpc::ClientContext context;
    std::unique_ptr<OpenStream> stream;
  };
  std::vector<std::unique_ptr<Opened>> streams;
  const int64_t before = ResidentBytes();
  for (const FieldPath& path : NumericFieldsOf(*v1::StreamFramesRequest::descriptor())) {
    for (size_t k = 0; k < NumExtremesOf(path); ++k) {
      v1::StreamFramesRequest request = HeldStream();
      ExcludeOther(request, path[0]->name());
      auto opened = std::make_unique<Opened>();
      opened->what = absl::StrCat(NameOf(path), " = ", SetExtreme(request, path, k));
      opened->stream = stub_->StreamFrames(&opened->context);
      opened->stream->Write(request);
      v1::StreamFramesResponse response;
      opened->stream->Read(&response);  // the first frame, or the end
      streams.push_back(std::move(opened));
    }
  }
  EXPECT_GT(streams.size(), 100U);
  EXPECT_LT(IdleCpuTime(), kMaxIdleCpu);
  EXPECT_LT(ResidentBytes() - before, kMaxGrowthBytes);
  EXPECT_TRUE(ServesFrames());
  for (const auto& opened : streams) {
    opened->context.TryCancel();
    const grpc::Status status = opened->stream->Finish();
    EXPECT_FALSE(kFaults.contains(status.error_code()))
        << opened->what << ": " << status.error_code() << " " << status.error_message();
  }
}

}  // namespace
}  // namespace liquidblend::rpc
