// Whatever numbers come in the place of the right ones, the server says what is wrong with them,
// and neither computes nor keeps anything for those who sent them. Jobs that it accepts are not run
// here: how they end is tested with the worker's limits (tests/worker/jobs).
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "google/rpc/error_details.pb.h"
#include "tests/server/extremes.h"
#include "tests/server/grpc/seeds.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

// The server's own mistakes; and what the client would hear of one that hangs or has gone.
const std::set<grpc::StatusCode> kFaults = {
    grpc::StatusCode::INTERNAL, grpc::StatusCode::UNKNOWN, grpc::StatusCode::DATA_LOSS,
    grpc::StatusCode::DEADLINE_EXCEEDED, grpc::StatusCode::UNAVAILABLE};

// Whether the status blames the field, by its last name: in the fields at fault, or where there are
// none in the message.
bool Names(const grpc::Status& status, const FieldPath& path) {
  const std::string& name = path.back()->name();
  const auto bad_request = DetailOf<google::rpc::BadRequest>(status);
  if (bad_request.field_violations().empty()) {
    return absl::StrContains(status.error_message(), name);
  }
  for (const auto& violation : bad_request.field_violations()) {
    const std::vector<std::string> words =
        absl::StrSplit(violation.field(), absl::ByAnyChar(".[]"));
    if (std::count(words.begin(), words.end(), name) > 0) return true;
    // Of points and parameters, the whole is at fault: correspondences[0].source, parameters[0].
    const std::string& whole = path[path.size() > 1 ? path.size() - 2 : 0]->name();
    if (std::count(words.begin(), words.end(), whole) > 0) return true;
  }
  return false;
}

class ExtremesTest : public ServerTest {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_.path() + "/sims/shot");
    std::ofstream(folder_.path() + "/sims/shot/f1.ply") << "abc";
    ServerOptions options;
    options.import_roots = {{"sims", folder_.path() + "/sims"}};
    Start(options);
    ImportAnimation("a");
    ImportAnimation("b");
    PublishFamily("splash", "a", "b", 1, {{"h"}, {{0.0}, {1.0}}});
    operation_ = "operations/" + SubmitImport("waiting").id();
  }

  static std::unique_ptr<Message> NewRequest(const MethodDescriptor& method) {
    return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()
                                        ->GetPrototype(method.input_type())
                                        ->New());
  }

  // The seeds with one number replaced: in the first message that has the field's group.
  std::vector<std::string> WithExtreme(const MethodDescriptor& method, const FieldPath& path,
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
      MakeNew(*request);
      messages[k] = request->SerializeAsString();
    }
    ++num_calls_;
    EXPECT_TRUE(request->ParseFromString(messages[chosen]));
    ExcludeOther(*request, path[0]->name());
    value = SetExtreme(*request, path, number);
    messages[chosen] = request->SerializeAsString();
    return messages;
  }

  // Names of what a call makes that no call before it has made, and of what there is.
  void MakeNew(Message& request) const {
    const auto* reflection = request.GetReflection();
    const auto set = [&](Message& message, const char* field, const std::string& text) {
      if (const auto* found = message.GetDescriptor()->FindFieldByName(field)) {
        message.GetReflection()->SetString(&message, found, text);
      }
    };
    for (const char* field : {"family_id", "animation_id", "request_id"}) {
      set(request, field, absl::StrCat("new", num_calls_));
    }
    const auto* header = request.GetDescriptor()->FindFieldByName("header");
    if (header != nullptr && reflection->HasField(request, header)) {
      set(*reflection->MutableMessage(&request, header), "animation_id",
          absl::StrCat("new", num_calls_));
    }
    const std::string& type = request.GetDescriptor()->name();
    if (type == "WaitOperationRequest") set(request, "name", operation_);
  }

  // Weights and parameters exclude one another.
  static void ExcludeOther(Message& request, const std::string& field) {
    const char* const other = field == "parameters" ? "weights" : "parameters";
    if (const FieldDescriptor* found = request.GetDescriptor()->FindFieldByName(other)) {
      request.GetReflection()->ClearField(&request, found);
    }
  }

  // One call with the field's extreme of that number. Returns whether the field was looked at: it
  // was taken, or blamed.
  bool TryExtreme(const MethodDescriptor& method, const FieldPath& path, size_t number) {
    const bool waits = method.name() == "WaitOperation";
    std::string value;
    const std::vector<std::string> messages = WithExtreme(method, path, number, value);
    const absl::Duration before = CpuTime();
    const grpc::Status status =
        CallInBytes(channel_, PathOf(method), messages, "",
                    waits ? std::chrono::milliseconds(200) : std::chrono::milliseconds(20'000));
    const std::string what = absl::StrCat(method.name(), " ", NameOf(path), " = ", value, ": ",
                                          status.error_code(), " ", status.error_message());
    const bool has_waited = waits && status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
    EXPECT_TRUE(has_waited || !kFaults.contains(status.error_code())) << what;
    EXPECT_LT(CpuTime() - before, kMaxCallCpu) << what;
    last_ = what;
    // CallInBytes cancels a stream that has more frames than it reads.
    const bool has_frames =
        method.server_streaming() && status.error_code() == grpc::StatusCode::CANCELLED;
    return status.ok() || has_waited || has_frames || Names(status, path);
  }

  bool ServesFrames() {
    v1::GetFrameRequest request;
    request.set_family("families/splash");
    request.add_weights(0.5);
    v1::Frame frame;
    grpc::ClientContext context;
    return stub_->GetFrame(&context, request, &frame).ok();
  }

  std::string operation_;  // that never ends
  int num_calls_ = 0;
  std::string last_;  // what was called last, and what came of it
};

TEST_F(ExtremesTest, EveryNumberOfEveryRequestMayBeAnything) {
  ASSERT_TRUE(ServesFrames());
  ResetPeakMemory();
  const int64_t before = PeakBytes();
  for (const MethodDescriptor* method : AllMethods()) {
    for (const FieldPath& path : NumericFieldsOf(*method->input_type())) {
      bool is_reached = false;
      for (size_t k = 0; k < NumExtremesOf(path); ++k) {
        is_reached |= TryExtreme(*method, path, k);
      }
      EXPECT_TRUE(is_reached) << "nobody looked at the field: " << last_;
    }
  }
  EXPECT_GT(num_calls_, 500);
  EXPECT_LT(PeakBytes() - before, kMaxGrowthBytes);
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

struct OpenedStream {
  std::string what;
  grpc::ClientContext context;
  std::unique_ptr<OpenStream> stream;
  bool has_frame = false;
};

TEST_F(ExtremesTest, StreamsThatStayOpenCostNothing) {
  std::vector<std::pair<FieldPath, std::vector<std::unique_ptr<OpenedStream>>>> streams;
  size_t num_streams = 0;
  ASSERT_TRUE(ServesFrames());
  ResetPeakMemory();
  const int64_t before = PeakBytes();
  for (const FieldPath& path : NumericFieldsOf(*v1::StreamFramesRequest::descriptor())) {
    auto& opened = streams.emplace_back(path, std::vector<std::unique_ptr<OpenedStream>>()).second;
    for (size_t k = 0; k < NumExtremesOf(path); ++k, ++num_streams) {
      v1::StreamFramesRequest request = HeldStream();
      if (path[0]->name() == "parameters") request.add_parameters()->set_name("h");
      ExcludeOther(request, path[0]->name());
      OpenedStream& one = *opened.emplace_back(std::make_unique<OpenedStream>());
      one.what = absl::StrCat(NameOf(path), " = ", SetExtreme(request, path, k));
      one.stream = stub_->StreamFrames(&one.context);
      one.stream->Write(request);
      v1::StreamFramesResponse response;
      const bool waits = request.has_credit() && request.credit() == 0;  // for a frame's credit
      one.has_frame = !waits && one.stream->Read(&response);  // the first frame, or the end
    }
  }
  EXPECT_GT(num_streams, 100U);
  EXPECT_LT(IdleCpuTime(), kMaxIdleCpu);
  EXPECT_LT(PeakBytes() - before, kMaxGrowthBytes);
  EXPECT_TRUE(ServesFrames());
  for (const auto& [path, opened] : streams) {
    bool is_reached = false;
    for (const auto& one : opened) {
      one->context.TryCancel();
      const grpc::Status status = one->stream->Finish();
      EXPECT_FALSE(kFaults.contains(status.error_code()))
          << one->what << ": " << status.error_code() << " " << status.error_message();
      is_reached |= one->has_frame || Names(status, path);
    }
    EXPECT_TRUE(is_reached) << "nobody looked at the field: " << NameOf(path);
  }
}

}  // namespace
}  // namespace liquidblend::server
