#include "tests/fuzz/fuzz_source.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"

namespace liquidblend::fuzz {
namespace {

constexpr char kGeneration[] = "drops/1/content";

}  // namespace

template <typename Reply>
void FuzzSource::Give(absl::StatusOr<Reply> reply, Done<Reply> done) {
  if (options_.fails) reply = absl::UnavailableError("the store is away");
  if (!options_.is_deferred) return done(std::move(reply));
  waiting_.push_back(
      [reply = std::move(reply), done = std::move(done)]() mutable { done(std::move(reply)); });
}

bool FuzzSource::AnswerNext() {
  if (waiting_.empty()) return false;
  absl::AnyInvocable<void()> answer = std::move(waiting_.front());
  waiting_.pop_front();
  answer();
  return true;
}

absl::Status FuzzSource::Admit(const server::Credentials& credentials, const server::AccessRequest&,
                               server::AccessGrant& grant) {
  if (options_.needs_token && credentials.authorization != "Bearer good") {
    return absl::UnauthenticatedError("no token");
  }
  grant.principal.name = server::kAnonymous;
  grant.principal.key = server::kAnonymous;
  return absl::OkStatus();
}

server::FrameSource::Cancel FuzzSource::GetFrame(v1::GetFrameRequest request, std::string,
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

void FuzzSource::FindVersion(const std::string& family, int64_t version,
                             Done<server::FamilyVersion> done) {
  if (family != "families/drops" || version > 1) {
    return Give<server::FamilyVersion>(absl::NotFoundError(absl::StrCat("no ", family)),
                                       std::move(done));
  }
  Give<server::FamilyVersion>(server::FamilyVersion{1, kGeneration}, std::move(done));
}

void FuzzSource::GetFamily(v1::GetFamilyRequest request, Done<v1::Family> done) {
  v1::Family family;
  family.set_name(request.name());
  family.set_version(1);
  if (request.name() == "families/drops")
    return Give<v1::Family>(std::move(family), std::move(done));
  Give<v1::Family>(absl::NotFoundError(absl::StrCat("no ", request.name())), std::move(done));
}

void FuzzSource::ListFamilies(v1::ListFamiliesRequest request,
                              Done<v1::ListFamiliesResponse> done) {
  v1::ListFamiliesResponse response;
  response.add_families()->set_name("families/drops");
  response.set_next_page_token(request.page_token());
  Give<v1::ListFamiliesResponse>(std::move(response), std::move(done));
}

std::shared_ptr<server::StreamSession> FuzzSource::OpenStream(
    std::string client, std::weak_ptr<server::StreamSession::Sink> sink) {
  return std::make_shared<server::StreamSession>(host_, std::move(client), std::move(sink));
}

void FuzzSource::CheckStores(Done<std::string> done) {
  Give<std::string>(std::string("ok"), std::move(done));
}

void FuzzSource::GetMetricsText(Done<std::string> done) {
  Give<std::string>(std::string("# none\n"), std::move(done));
}

// Made once: they take longer to make than a run takes, and keep no state that a client can see.
metrics::Metrics& FuzzSource::metrics() {
  static auto& metrics = *new metrics::Metrics();
  return metrics;
}

server::CallLog& FuzzSource::call_log() {
  static auto& log = *new server::CallLog([](absl::Duration, const std::function<void()>&) {});
  return log;
}

}  // namespace liquidblend::fuzz
