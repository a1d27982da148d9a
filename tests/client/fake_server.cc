#include "tests/client/fake_server.h"

#include <google/protobuf/text_format.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/synchronization/mutex.h"
#include "google/longrunning/operations.grpc.pb.h"
#include "google/rpc/error_details.pb.h"
#include "liquidblend/v1/liquidblend.grpc.pb.h"
#include "tests/client/canned_answers.h"

namespace liquidblend::testing {
namespace {

using grpc::ServerContext;
namespace lro = google::longrunning;

constexpr int kNumMany = 2500;

std::string Id(const std::string& name) { return name.substr(name.find('/') + 1); }

grpc::Status NotFound(const std::string& name) {
  return grpc::Status(grpc::StatusCode::NOT_FOUND, name + " does not exist");
}

// The weights that are asked for; by parameters, as the family's points say.
template <typename Request>
std::vector<double> WeightsOf(const Request& request) {
  if (request.parameters().empty()) return {request.weights().begin(), request.weights().end()};
  return {(request.parameters(0).value() - 1.0) / 2.0};
}

template <typename Request>
bool IsOutsideOfHull(const Request& request) {
  if (request.parameters().empty()) return false;
  const double weight = WeightsOf(request)[0];
  return weight < 0.0 || weight > 1.0;
}

template <typename Request>
v1::Frame FrameFor(const Request& request, double time_s) {
  v1::Frame frame =
      MakeFrame(request.family(), WeightsOf(request), time_s, request.encoding().position_bits());
  frame.set_extrapolated(IsOutsideOfHull(request));
  frame.set_clamped(!request.weights().empty() && request.weights(0) < kCannedMinWeight);
  return frame;
}

}  // namespace

class FakeServer::Impl final : public v1::LiquidBlend::Service, public lro::Operations::Service {
 public:
  Impl() {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(static_cast<v1::LiquidBlend::Service*>(this));
    builder.RegisterService(static_cast<lro::Operations::Service*>(this));
    server_ = builder.BuildAndStart();
  }
  ~Impl() override { server_->Shutdown(std::chrono::system_clock::now()); }

  void SetHealthy(bool is_healthy) {
    server_->GetHealthCheckService()->SetServingStatus(is_healthy);
  }

  grpc::Status UploadAnimation(ServerContext* context,
                               grpc::ServerReader<v1::UploadAnimationRequest>* in,
                               lro::Operation* operation) override {
    NoteTrace(*context);
    if (grpc::Status status = Enter("UploadAnimation"); !status.ok()) return status;
    ReceivedUpload upload;
    std::string file;
    v1::UploadAnimationRequest message;
    while (in->Read(&message)) {
      if (message.has_header()) {
        upload.animation_id = message.header().animation_id();
        upload.request_id = message.header().request_id();
        upload.frames_per_second = message.header().options().frames_per_second();
      } else if (message.has_file()) {
        if (!file.empty() && refuse_.exchange(false)) return refusal_;
        file = message.file().name();
        upload.files[file] = "";
        upload.announced[file] = message.file().size_bytes();
      } else {
        upload.files[file] += message.chunk();
        upload.chunk_bytes.push_back(static_cast<int64_t>(message.chunk().size()));
      }
    }
    const absl::MutexLock lock(&mutex);
    uploads.push_back(upload);
    *operation = MakeOperation("import-1");
    return grpc::Status::OK;
  }

  grpc::Status ImportAnimation(ServerContext*, const v1::ImportAnimationRequest* request,
                               lro::Operation* operation) override {
    {
      const absl::MutexLock lock(&mutex);
      google::protobuf::TextFormat::PrintToString(*request, &last_request);
    }
    if (grpc::Status status = Enter("ImportAnimation"); !status.ok()) return status;
    *operation = MakeOperation("import-1");
    return grpc::Status::OK;
  }

  grpc::Status GetAnimation(ServerContext*, const v1::GetAnimationRequest* request,
                            v1::Animation* animation) override {
    if (grpc::Status status = Enter("GetAnimation"); !status.ok()) return status;
    if (!absl::StartsWith(request->name(), "animations/drops-")) return NotFound(request->name());
    *animation = MakeAnimation(Id(request->name()));
    const absl::MutexLock lock(&mutex);
    if (!words.empty()) animation->set_notes(0, words);
    return grpc::Status::OK;
  }

  grpc::Status ListAnimations(ServerContext*, const v1::ListAnimationsRequest* request,
                              v1::ListAnimationsResponse* response) override {
    if (grpc::Status status = Enter("ListAnimations"); !status.ok()) return status;
    int begin = 0;
    if (!request->page_token().empty()) begin = std::stoi(request->page_token());
    const int end = std::min(begin + request->page_size(), kNumMany + 2);
    for (int i = begin; i < end; ++i) {
      *response->add_animations() = MakeAnimation(i == 0   ? "drops-a"
                                                  : i == 1 ? "drops-b"
                                                           : absl::StrFormat("many-%04d", i - 2));
    }
    if (end < kNumMany + 2) response->set_next_page_token(absl::StrCat(end));
    return grpc::Status::OK;
  }

  grpc::Status DeleteAnimation(ServerContext*, const v1::DeleteAnimationRequest* request,
                               google::protobuf::Empty*) override {
    return Delete("DeleteAnimation", request->name());
  }

  grpc::Status RegisterFamily(ServerContext*, const v1::RegisterFamilyRequest* request,
                              lro::Operation* operation) override {
    {
      const absl::MutexLock lock(&mutex);
      request_ids.push_back(request->request_id());
      google::protobuf::TextFormat::PrintToString(*request, &last_request);
    }
    if (grpc::Status status = Enter("RegisterFamily"); !status.ok()) return status;
    *operation = Reworded(MakeOperation(request->family_id() == "bad" ? "failed-1" : "register-1"));
    return grpc::Status::OK;
  }

  grpc::Status GetFamily(ServerContext*, const v1::GetFamilyRequest* request,
                         v1::Family* family) override {
    if (grpc::Status status = Enter("GetFamily"); !status.ok()) return status;
    const std::string id = Id(request->name());
    if (id != "drops" && id != "empty") return NotFound(request->name());
    *family = Reworded(MakeFamily(id));
    return grpc::Status::OK;
  }

  grpc::Status ListFamilies(ServerContext*, const v1::ListFamiliesRequest*,
                            v1::ListFamiliesResponse* response) override {
    if (grpc::Status status = Enter("ListFamilies"); !status.ok()) return status;
    *response->add_families() = MakeFamily("drops");
    *response->add_families() = MakeFamily("empty");
    return grpc::Status::OK;
  }

  grpc::Status RollbackFamily(ServerContext*, const v1::RollbackFamilyRequest* request,
                              v1::Family* family) override {
    if (grpc::Status status = Enter("RollbackFamily"); !status.ok()) return status;
    if (Id(request->name()) != "drops" || request->version() != 2) {
      return NotFound(request->name());
    }
    *family = MakeFamily("drops");
    family->set_version(4);
    family->set_restored_version(request->version());
    return grpc::Status::OK;
  }

  grpc::Status DeleteFamily(ServerContext*, const v1::DeleteFamilyRequest* request,
                            google::protobuf::Empty*) override {
    return Delete("DeleteFamily", request->name());
  }

  grpc::Status WatchOperation(ServerContext* context, const v1::WatchOperationRequest* request,
                              grpc::ServerWriter<lro::Operation>* out) override {
    NoteTrace(*context);
    if (grpc::Status status = Enter("WatchOperation"); !status.ok()) return status;
    const std::string id = Id(request->name());
    if (!Known(id)) return NotFound(request->name());
    out->Write(MakeOperation(id));
    if (break_watch.exchange(false)) return {grpc::StatusCode::UNAVAILABLE, "going away"};
    if (id == "endless-1") return WaitUntilCancelled(context);
    out->Write(MakeFinished(id));
    return grpc::Status::OK;
  }

  grpc::Status GetFrame(ServerContext* context, const v1::GetFrameRequest* request,
                        v1::Frame* frame) override {
    NoteTrace(*context);
    {
      const absl::MutexLock lock(&mutex);
      google::protobuf::TextFormat::PrintToString(*request, &last_request);
    }
    if (grpc::Status status = Enter("GetFrame"); !status.ok()) return status;
    if (request->time_s() < 0.0 || request->time_s() > kCannedDuration) {
      return {grpc::StatusCode::OUT_OF_RANGE, "time_s lies outside [0, 1]"};
    }
    if (IsOutsideOfHull(*request) && !request->extrapolate()) {
      return {grpc::StatusCode::OUT_OF_RANGE, "parameters: outside of the hull"};
    }
    *frame = FrameFor(*request, request->time_s());
    return grpc::Status::OK;
  }

  grpc::Status StreamFrames(ServerContext* context,
                            grpc::ServerReaderWriter<v1::StreamFramesResponse,
                                                     v1::StreamFramesRequest>* stream) override {
    NoteTrace(*context);
    if (grpc::Status status = Enter("StreamFrames"); !status.ok()) return status;
    v1::StreamFramesRequest settings;
    if (!stream->Read(&settings)) return {grpc::StatusCode::INVALID_ARGUMENT, "no request"};
    {
      const absl::MutexLock lock(&mutex);
      google::protobuf::TextFormat::PrintToString(settings, &last_request);
    }
    const int64_t num_until_hold = hold_stream.exchange(kNever);
    if (num_until_hold != kNever) return SendAndHold(settings, num_until_hold, context, stream);
    if (settings.lossless()) return SendAll(settings, stream);
    return SendUntilCancelled(settings, context, stream);
  }

  grpc::Status GetOperation(ServerContext*, const lro::GetOperationRequest* request,
                            lro::Operation* operation) override {
    if (grpc::Status status = Enter("GetOperation"); !status.ok()) return status;
    if (!Known(Id(request->name()))) return NotFound(request->name());
    *operation = Reworded(MakeOperation(Id(request->name())));
    return grpc::Status::OK;
  }

  grpc::Status ListOperations(ServerContext*, const lro::ListOperationsRequest*,
                              lro::ListOperationsResponse* response) override {
    if (grpc::Status status = Enter("ListOperations"); !status.ok()) return status;
    *response->add_operations() = MakeFinished("import-1");
    *response->add_operations() = MakeOperation("register-1");
    *response->add_operations() = MakeFinished("failed-1");
    *response->add_operations() = MakeOperation("retried-1");
    return grpc::Status::OK;
  }

  grpc::Status CancelOperation(ServerContext*, const lro::CancelOperationRequest* request,
                               google::protobuf::Empty*) override {
    if (grpc::Status status = Enter("CancelOperation"); !status.ok()) return status;
    return Known(Id(request->name())) ? grpc::Status::OK : NotFound(request->name());
  }

  void SetRefusal(const absl::Status& status) {
    refusal_ =
        grpc::Status(static_cast<grpc::StatusCode>(status.code()), std::string(status.message()));
    refuse_ = true;
  }

  int port() const { return port_; }

  mutable absl::Mutex mutex;
  std::map<std::string, std::vector<absl::Status>> failures;
  std::map<std::string, int> num_calls;
  std::vector<std::string> request_ids;
  std::vector<std::string> deleted;
  std::vector<ReceivedUpload> uploads;
  std::string last_request;
  std::string words;  // empty: as they are
  TraceHeaders last_trace;
  bool with_details = false;
  std::atomic<bool> break_watch = false;
  std::atomic<bool> break_stream = false;
  static constexpr int64_t kNever = -1;
  std::atomic<int64_t> stop_stream = kNever;  // after so many frames
  std::atomic<int64_t> hold_stream = kNever;  // likewise

 private:
  static bool Known(const std::string& id) {
    return id == "endless-1" || id == "import-1" || id == "register-1" || id == "failed-1" ||
           id == "cancelled-1";
  }

  v1::Family Reworded(v1::Family family) const {
    const absl::MutexLock lock(&mutex);
    if (words.empty() || family.reports().empty()) return family;
    family.set_targets(0, "animations/" + words);
    family.mutable_reports(0)->mutable_verdict()->set_reason(words);
    return family;
  }

  lro::Operation Reworded(lro::Operation operation) const {
    const absl::MutexLock lock(&mutex);
    v1::RegisterFamilyMetadata metadata;
    if (words.empty() || !operation.metadata().UnpackTo(&metadata)) return operation;
    operation.set_name("operations/" + words);
    metadata.mutable_progress()->set_stage(words);
    operation.mutable_metadata()->PackFrom(metadata);
    return operation;
  }

  static grpc::Status WaitUntilCancelled(ServerContext* context) {
    absl::Mutex never;
    const bool woken = false;
    while (!context->IsCancelled()) {
      const absl::MutexLock lock(&never);
      never.AwaitWithTimeout(absl::Condition(&woken), absl::Milliseconds(1));
    }
    return grpc::Status::CANCELLED;
  }

  void NoteTrace(const ServerContext& context) {
    const auto value_of = [&](const char* name) {
      const auto found = context.client_metadata().find(name);
      if (found == context.client_metadata().end()) return std::string();
      return std::string(found->second.data(), found->second.size());
    };
    const absl::MutexLock lock(&mutex);
    last_trace = {value_of("traceparent"), value_of("tracestate")};
  }

  // Counts a call, and fails it if a test wants that.
  grpc::Status Enter(const std::string& method) {
    const absl::MutexLock lock(&mutex);
    ++num_calls[method];
    std::vector<absl::Status>& planned = failures[method];
    if (planned.empty()) return grpc::Status::OK;
    const absl::Status failure = planned.back();
    planned.pop_back();
    return {static_cast<grpc::StatusCode>(failure.code()), std::string(failure.message()),
            Details(failure)};
  }

  std::string Details(const absl::Status& failure) const {
    google::rpc::Status status;
    status.set_code(static_cast<int>(failure.code()));
    failure.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) {
      google::protobuf::Any& detail = *status.add_details();
      detail.set_type_url(std::string(url));
      detail.set_value(std::string(payload));
    });
    if (with_details) AddDetails(status);
    return status.SerializeAsString();
  }

  static void AddDetails(google::rpc::Status& status) {
    google::rpc::ErrorInfo info;
    info.set_reason("FAMILY_BUSY");
    (*info.mutable_metadata())["family"] = "drops";
    status.add_details()->PackFrom(info);
    google::rpc::BadRequest bad_request;
    google::rpc::BadRequest::FieldViolation* violation = bad_request.add_field_violations();
    violation->set_field("weights[0]");
    violation->set_description("is 7; it must be in [-1, 2]");
    status.add_details()->PackFrom(bad_request);
  }

  grpc::Status Delete(const std::string& method, const std::string& name) {
    bool is_new = false;
    {
      const absl::MutexLock lock(&mutex);
      is_new = std::find(deleted.begin(), deleted.end(), name) == deleted.end();
      if (is_new) deleted.push_back(name);  // done, even if the answer is then lost
    }
    if (grpc::Status status = Enter(method); !status.ok()) return status;
    return is_new ? grpc::Status::OK : NotFound(name);
  }

  static v1::StreamFramesResponse ResponseFor(const v1::StreamFramesRequest& settings,
                                              double time_s, int64_t index) {
    v1::StreamFramesResponse response;
    *response.mutable_frame() = FrameFor(settings, time_s);
    response.set_frame_index(index);
    response.set_level_of_detail(settings.adapt_level_of_detail() ? 1 : 0);
    return response;
  }

  template <typename Stream>
  grpc::Status SendAll(const v1::StreamFramesRequest& settings, Stream* stream) {
    const bool breaks = break_stream.exchange(false);
    const int64_t num_until_stop = stop_stream.exchange(kNever);
    const double pace =
        settings.has_frames_per_second() ? settings.frames_per_second() : kCannedFramesPerSecond;
    const double left = kCannedDuration - settings.time_s();
    const auto num_frames = static_cast<int64_t>(std::floor(left * pace + 1e-9)) + 1;
    for (int64_t i = 0; i <= num_frames; ++i) {
      if (breaks && i == 2) return {grpc::StatusCode::UNAVAILABLE, "the server is stopping"};
      if (i == num_until_stop) return {grpc::StatusCode::UNAVAILABLE, "moved"};
      if (i == num_frames) break;
      const auto time_of = [&](int64_t k) {
        return settings.time_s() + static_cast<double>(k) / pace;
      };
      v1::StreamFramesResponse response = ResponseFor(settings, time_of(i), i);
      if (!breaks) response.set_num_requests(1);
      if (!breaks && i + 1 < num_frames) response.set_next_time_s(time_of(i + 1));
      stream->Write(response);
    }
    return grpc::Status::OK;
  }

  template <typename Stream>
  static grpc::Status SendAndHold(const v1::StreamFramesRequest& settings, int64_t num_frames,
                                  ServerContext* context, Stream* stream) {
    for (int64_t i = 0; i < num_frames; ++i) stream->Write(ResponseFor(settings, 0.0, i));
    while (!context->IsCancelled()) absl::SleepFor(absl::Milliseconds(1));
    return grpc::Status::CANCELLED;
  }

  // A frame a millisecond, always with the newest weights.
  template <typename Stream>
  grpc::Status SendUntilCancelled(v1::StreamFramesRequest settings, ServerContext* context,
                                  Stream* stream) {
    const int64_t num_until_stop = stop_stream.exchange(kNever);
    absl::Mutex settings_mutex;
    bool closed = false;
    int64_t num_requests = 1;
    std::thread reader([&] {
      v1::StreamFramesRequest change;
      while (stream->Read(&change)) {
        const absl::MutexLock lock(&settings_mutex);
        if (change.weights_size() + change.parameters_size() > 0) {
          settings.clear_weights();
          settings.clear_parameters();
        }
        settings.MergeFrom(change);
        ++num_requests;
      }
      const absl::MutexLock lock(&settings_mutex);
      closed = true;
    });
    for (int64_t i = 0; !context->IsCancelled(); ++i) {
      settings_mutex.Lock();
      settings_mutex.AwaitWithTimeout(absl::Condition(&closed), absl::Milliseconds(1));
      v1::StreamFramesResponse response = ResponseFor(settings, settings.time_s(), i);
      response.set_next_time_s(settings.time_s());
      response.set_num_requests(num_requests);
      settings_mutex.Unlock();
      if (i == num_until_stop) context->TryCancel();
      stream->Write(response);
    }
    reader.join();
    return grpc::Status::CANCELLED;
  }

  int port_ = 0;
  std::atomic<bool> refuse_ = false;
  grpc::Status refusal_;
  std::unique_ptr<grpc::Server> server_;
};

FakeServer::FakeServer() : impl_(std::make_unique<Impl>()) {}
FakeServer::~FakeServer() = default;

std::string FakeServer::target() const { return absl::StrCat("127.0.0.1:", port()); }

int FakeServer::port() const { return impl_->port(); }

void FakeServer::FailNext(const std::string& method, int times, const absl::Status& status) {
  const absl::MutexLock lock(&impl_->mutex);
  impl_->failures[method].assign(static_cast<size_t>(times), status);
}

absl::Status WithRetryDelay(absl::Status status, absl::Duration delay) {
  google::rpc::RetryInfo info;
  info.mutable_retry_delay()->set_seconds(absl::IDivDuration(delay, absl::Seconds(1), &delay));
  info.mutable_retry_delay()->set_nanos(static_cast<int32_t>(absl::ToInt64Nanoseconds(delay)));
  status.SetPayload("type.googleapis.com/google.rpc.RetryInfo",
                    absl::Cord(info.SerializeAsString()));
  return status;
}

absl::Status WithReason(absl::Status status, const std::string& reason) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  status.SetPayload("type.googleapis.com/google.rpc.ErrorInfo",
                    absl::Cord(info.SerializeAsString()));
  return status;
}

void FakeServer::AddErrorDetails() {
  const absl::MutexLock lock(&impl_->mutex);
  impl_->with_details = true;
}

void FakeServer::BreakNextWatch() { impl_->break_watch = true; }
void FakeServer::BreakNextStream() { impl_->break_stream = true; }
void FakeServer::HoldNextStream(int num_frames) { impl_->hold_stream = num_frames; }
void FakeServer::StopNextStream(int num_frames) { impl_->stop_stream = num_frames; }
void FakeServer::SetHealthy(bool is_healthy) { impl_->SetHealthy(is_healthy); }
void FakeServer::RefuseNextUpload(const absl::Status& status) { impl_->SetRefusal(status); }

void FakeServer::SetWords(const std::string& words) {
  const absl::MutexLock lock(&impl_->mutex);
  impl_->words = words;
}

int FakeServer::NumCalls(const std::string& method) const {
  const absl::MutexLock lock(&impl_->mutex);
  return impl_->num_calls[method];
}

std::vector<std::string> FakeServer::RequestIds() const {
  const absl::MutexLock lock(&impl_->mutex);
  return impl_->request_ids;
}

std::vector<ReceivedUpload> FakeServer::Uploads() const {
  const absl::MutexLock lock(&impl_->mutex);
  return impl_->uploads;
}

TraceHeaders FakeServer::LastTrace() const {
  const absl::MutexLock lock(&impl_->mutex);
  return impl_->last_trace;
}

std::string FakeServer::LastRequest() const {
  const absl::MutexLock lock(&impl_->mutex);
  return impl_->last_request;
}

std::vector<std::string> FakeServer::Deleted() const {
  const absl::MutexLock lock(&impl_->mutex);
  return impl_->deleted;
}

}  // namespace liquidblend::testing
