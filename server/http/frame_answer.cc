#include "server/http/frame_answer.h"

#include <algorithm>

#include "server/http/replies.h"

namespace liquidblend::http {
namespace {

constexpr int kMaxLooks = 3;  // at versions that are replaced before they can be asked for

}  // namespace

void FrameAnswer::Start(rpc::FrameSource& source, FrameAsk ask,
                        std::shared_ptr<Cancellation> cancellation, Done done) {
  const auto answer = std::make_shared<FrameAnswer>(source, std::move(ask), std::move(cancellation),
                                                    std::move(done));
  if (answer->ask_.if_none_match.empty()) return answer->Make(answer->ask_.request.version());
  answer->Look();
}

// What the client has is neither made nor sent again.
void FrameAnswer::Look() {
  ++num_looks_;
  if (ask_.request.version() != 0) return Decide(ask_.request.version());
  v1::GetFamilyRequest request;
  request.set_name(ask_.request.family());
  source_.GetFamily(request, [self = shared_from_this()](const absl::StatusOr<v1::Family>& family) {
    if (!family.ok()) return self->done_(ErrorReply(family.status()));
    self->Decide(family->version());
  });
}

void FrameAnswer::Decide(int64_t published) {
  published_ = published;
  const std::string tag = FrameTag(ask_.request, published);
  if (HasClient(tag)) return SayUnchanged(tag);
  Make(num_looks_ > 1 ? published : ask_.request.version());
}

void FrameAnswer::Make(int64_t version) {
  v1::GetFrameRequest request = ask_.request;
  request.set_version(version);
  const int number = ++num_made_;
  auto cancel = source_.GetFrame(
      request, ask_.client, [self = shared_from_this(), version](absl::StatusOr<v1::Frame> made) {
        self->OnMade(version, std::move(made));
      });
  if (num_made_ == number) cancellation_->Arm(std::move(cancel));  // it may have asked for the next
}

void FrameAnswer::OnMade(int64_t asked_version, absl::StatusOr<v1::Frame> made) {
  const bool is_replaced = ask_.request.version() == 0 && asked_version != 0 &&
                           absl::IsNotFound(made.status()) && num_looks_ < kMaxLooks;
  if (is_replaced) return Look();
  if (!made.ok()) return done_(ErrorReply(made.status()));
  const std::string tag = FrameTag(ask_.request, made->version());
  if (HasClient(tag)) return SayUnchanged(tag);
  const int64_t newest_known = std::min(NewestTagged(ask_.if_none_match), published_);
  if (asked_version == 0 && made->version() < newest_known) return Make(published_);
  Response response = FrameReply(*std::move(made));
  AddCaching(ask_.request, tag, ask_.is_private, response);
  done_(std::move(response));
}

bool FrameAnswer::HasClient(const std::string& tag) const {
  return !ask_.if_none_match.empty() && HasTag(ask_.if_none_match, tag);
}

void FrameAnswer::SayUnchanged(const std::string& tag) {
  Response response;
  response.code = 304;
  AddCaching(ask_.request, tag, ask_.is_private, response);
  done_(std::move(response));
}

}  // namespace liquidblend::http
