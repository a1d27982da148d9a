#include "tests/fuzz/fuzz_api.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/tar/tar_splitter.h"
#include "tests/fuzz/require.h"

namespace liquidblend::fuzz {
namespace lro = google::longrunning;
namespace {

// Counts the bytes of an archive's files.
class CountingUpload final : public server::ArchiveUpload, private tar::FileSink {
 public:
  void Add(std::string piece, absl::AnyInvocable<void(absl::Status)> done) override {
    done(splitter_.Add(std::as_bytes(std::span(piece)), *this));
  }
  void Submit(absl::AnyInvocable<void(absl::StatusOr<lro::Operation>)> done) override {
    const absl::Status end = splitter_.End();
    if (!end.ok()) return done(end);
    lro::Operation operation;
    operation.set_name(absl::StrCat("operations/", num_bytes_));
    done(std::move(operation));
  }

 private:
  absl::Status BeginFile(const tar::TarEntry& file) override {
    Require(file.size_bytes >= 0, "a file has a size");
    Require(file.name.find('/') == std::string::npos, "a name has no directory");
    bytes_left_ = file.size_bytes;
    return absl::OkStatus();
  }
  absl::Status AddBytes(std::span<const std::byte> bytes) override {
    bytes_left_ -= static_cast<int64_t>(bytes.size());
    Require(bytes_left_ >= 0, "no file has more bytes than its header says");
    num_bytes_ += bytes.size();
    return absl::OkStatus();
  }

  tar::TarSplitter splitter_;
  int64_t bytes_left_ = 0;
  size_t num_bytes_ = 0;
};

constexpr size_t kMaxEcho = 200;
constexpr char kGeneration[] = "drops/1/content";

}  // namespace

template <typename Reply>
void FuzzApi::Give(absl::StatusOr<Reply> reply, Done<Reply> done) {
  if (options_.fails) reply = absl::UnavailableError("the store is away");
  if (!options_.is_deferred) return done(std::move(reply));
  waiting_.push_back(
      [reply = std::move(reply), done = std::move(done)]() mutable { done(std::move(reply)); });
}

bool FuzzApi::AnswerNext() {
  if (waiting_.empty()) return false;
  absl::AnyInvocable<void()> answer = std::move(waiting_.front());
  waiting_.pop_front();
  answer();
  return true;
}

absl::Status FuzzApi::Admit(const server::Credentials& credentials, const server::AccessRequest&,
                            server::AccessGrant& grant) {
  if (options_.needs_token && credentials.authorization != "Bearer good") {
    return absl::UnauthenticatedError("no token");
  }
  grant.principal.name = server::kAnonymous;
  grant.principal.key = server::kAnonymous;
  return absl::OkStatus();
}

server::Api::Cancel FuzzApi::GetFrame(v1::GetFrameRequest request, std::string, trace::Span,
                                      Done<server::MadeFrame> done) {
  server::MadeFrame made;
  made.generation = kGeneration;
  v1::Frame& frame = made.frame;
  frame.set_data("DRACO");
  frame.set_version(request.version() == 0 ? 1 : request.version());
  *frame.mutable_weights() = request.weights();
  frame.set_time_s(request.time_s());
  // Answered or cancelled, whichever comes first.
  auto open = std::make_shared<std::optional<Done<server::MadeFrame>>>(std::move(done));
  const auto finish = [open](absl::StatusOr<server::MadeFrame> reply) {
    if (!open->has_value()) return;
    Done<server::MadeFrame> callback = *std::exchange(*open, std::nullopt);
    callback(std::move(reply));
  };
  Give<server::MadeFrame>(std::move(made), finish);
  return [finish] { finish(absl::CancelledError("the client has gone")); };
}

void FuzzApi::FindVersion(const std::string& family, int64_t version,
                          Done<server::FamilyVersion> done) {
  if (family != "families/drops" || version > 1) {
    return Give<server::FamilyVersion>(absl::NotFoundError(absl::StrCat("no ", family)),
                                       std::move(done));
  }
  Give<server::FamilyVersion>(server::FamilyVersion{1, kGeneration}, std::move(done));
}

// Gives the request back as the name of a family, so that answers show what was understood.
void FuzzApi::Call(const server::Method& method, const server::Caller&, Read read,
                   server::IsWanted, Done<server::MessagePtr> done) {
  const server::UnaryMethod* unary = server::FindUnaryMethod(method.name);
  server::MessagePtr request =
      unary != nullptr ? unary->new_request()
      : method.name == std::string_view("ImportAnimation")
          ? std::make_unique<v1::ImportAnimationRequest>()
          : server::MessagePtr(std::make_unique<lro::WaitOperationRequest>());
  const absl::Status status = read(*request);
  if (!status.ok()) return Give<server::MessagePtr>(status, std::move(done));
  if (server::IsSame(method, server::kGetAnimationFrame)) {
    auto frame = std::make_unique<v1::AnimationFrame>();
    frame->set_data("DRACO");
    return Give<server::MessagePtr>(std::move(frame), std::move(done));
  }
  auto family = std::make_unique<v1::Family>();
  family->set_name(request->Utf8DebugString().substr(0, kMaxEcho));
  Give<server::MessagePtr>(std::move(family), std::move(done));
}

// Changes twice, then it is done.
server::Api::NextOperation FuzzApi::WatchOperation(const std::string& name, server::IsWanted) {
  return [this, name, num_seen = 0](Done<server::SeenOperationPtr> done) mutable {
    auto seen = std::make_shared<server::SeenOperation>();
    seen->operation.set_name(name);
    seen->operation.set_done(++num_seen > 2);
    Give<server::SeenOperationPtr>(std::move(seen), std::move(done));
  };
}

std::shared_ptr<server::ArchiveUpload> FuzzApi::OpenUpload(v1::UploadAnimationRequest,
                                                           const server::Caller&) {
  return std::make_shared<CountingUpload>();
}

std::shared_ptr<server::StreamSession> FuzzApi::OpenStream(
    std::string client, std::weak_ptr<server::StreamSession::Sink> sink, trace::Span span) {
  return std::make_shared<server::StreamSession>(host_, std::move(client), std::move(sink),
                                                 std::move(span));
}

absl::Status FuzzApi::Post(absl::AnyInvocable<void()> work) {
  waiting_.push_back(std::move(work));
  return absl::OkStatus();
}

void FuzzApi::CheckIsReady(Done<std::string> done) {
  Give<std::string>(std::string("ok"), std::move(done));
}

void FuzzApi::GetMetricsText(Done<std::string> done) {
  Give<std::string>(std::string("# none\n"), std::move(done));
}

// Made once: they take longer to make than a run takes, and keep no state that a client can see.
metrics::Metrics& FuzzApi::metrics() {
  static auto& metrics = *new metrics::Metrics();
  return metrics;
}

server::CallLog& FuzzApi::call_log() {
  static auto& log = *new server::CallLog([](absl::Duration, const std::function<void()>&) {});
  return log;
}

const trace::Tracer& FuzzApi::tracer() {
  static const auto& tracer = *new trace::Tracer();
  return tracer;
}

}  // namespace liquidblend::fuzz
