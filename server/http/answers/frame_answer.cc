#include "server/http/answers/frame_answer.h"

#include <algorithm>

#include "server/http/exchange/replies.h"

namespace liquidblend::http {
namespace {

constexpr int kMaxLooks = 3;  // at versions that are replaced before they can be asked for

}  // namespace

void FrameAnswer::Start(server::Api& api, FrameAsk ask, std::shared_ptr<Cancellation> cancellation,
                        Done done) {
  const auto answer =
      std::make_shared<FrameAnswer>(api, std::move(ask), std::move(cancellation), std::move(done));
  if (answer->ask_.if_none_match.empty()) return answer->Make(answer->ask_.request.version());
  answer->Look();
}

// Looks up the version: a frame that the client has is neither made nor sent again.
void FrameAnswer::Look() {
  ++num_looks_;
  api_.FindVersion(ask_.request.family(), ask_.request.version(),
                   [self = shared_from_this()](const absl::StatusOr<server::FamilyVersion>& found) {
                     if (!found.ok()) return self->done_(found.status());
                     self->Decide(*found);
                   });
}

void FrameAnswer::Decide(const server::FamilyVersion& published) {
  const int64_t asked = ask_.request.version();
  published_ = published.version;
  const bool is_asked = published.version > 0 && (asked == 0 || asked == published.version) &&
                        (asked != 0 || published.version >= ask_.request.min_version());
  if (is_asked) {
    const std::string tag = FrameTag(ask_.request, published.version, published.generation);
    if (HasClient(tag)) return SayUnchanged(tag);
  }
  Make(num_looks_ > 1 ? published.version : asked);
}

// When the API returns, another thread may have answered and asked for the next frame already.
void FrameAnswer::Make(int64_t version) {
  v1::GetFrameRequest request = ask_.request;
  request.set_version(version);
  const int number = ++num_made_;
  auto cancel =
      api_.GetFrame(request, ask_.client, ask_.span,
                    [self = shared_from_this(), version](absl::StatusOr<server::MadeFrame> made) {
                      self->OnMade(version, std::move(made));
                    });
  cancellation_->Arm(number, std::move(cancel));
}

void FrameAnswer::OnMade(int64_t asked_version, absl::StatusOr<server::MadeFrame> made) {
  const bool is_replaced = ask_.request.version() == 0 && asked_version != 0 &&
                           absl::IsNotFound(made.status()) && num_looks_ < kMaxLooks;
  if (is_replaced) return Look();
  if (!made.ok()) return done_(made.status());
  const int64_t version = made->frame.version();
  const std::string tag = FrameTag(ask_.request, version, made->generation);
  if (HasClient(tag)) return SayUnchanged(tag);
  const int64_t newest_known = std::min(NewestTagged(ask_.if_none_match), published_);
  if (asked_version == 0 && version < newest_known) return Make(published_);
  Response response = FrameReply(std::move(made->frame), ask_.request.encoding().format());
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
