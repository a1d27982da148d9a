#include "server/http/answers/animation_frame_answer.h"

#include <google/protobuf/message.h>

#include "absl/strings/str_cat.h"
#include "server/base/names.h"
#include "server/http/exchange/replies.h"
#include "server/transcode/query_message.h"

namespace liquidblend::http {
namespace {

absl::Status ReadQuery(const Exchange& exchange, google::protobuf::Message& message) {
  auto& request = static_cast<v1::GetAnimationFrameRequest&>(message);
  server::FieldViolations violations;
  for (const transcode::QueryField& field : exchange.fields) {
    const bool is_of_path = field.name == "animation" || field.name == "encoding.format";
    if (is_of_path) violations.Add(field.name, "is in the path already");
    if (!is_of_path) transcode::SetField(field, request, violations);
  }
  request.set_animation(server::AnimationName(exchange.route.family));
  request.mutable_encoding()->set_format(exchange.route.format);
  return violations.ToStatus();
}

}  // namespace

void AnswerAnimationFrame(server::Api& api, const ExchangePtr& exchange) {
  v1::GetAnimationFrameRequest named;
  named.set_animation(server::AnimationName(exchange->route.family));
  exchange->resource = server::ResourceOf(named);
  api.Call(
      server::kGetAnimationFrame, exchange->caller,
      [exchange](google::protobuf::Message& request) { return ReadQuery(*exchange, request); },
      [exchange] { return !exchange->cancellation->is_cancelled(); },
      [exchange](absl::StatusOr<server::MessagePtr> made) {
        if (!made.ok()) return exchange->Fail(made.status());
        exchange->FinishBy([&] {
          return AnimationFrameReply(static_cast<v1::AnimationFrame&>(**made),
                                     exchange->route.format, exchange->request.if_none_match,
                                     server::IsKnown(exchange->caller.principal));
        });
      });
}

}  // namespace liquidblend::http
