#include "server/http/answers/method_answer.h"

#include <google/protobuf/message.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/http/exchange/media_type.h"
#include "server/http/exchange/replies.h"
#include "server/transcode/json.h"
#include "server/transcode/query_message.h"

namespace liquidblend::http {
namespace {

constexpr char kJson[] = "application/json";
constexpr size_t kMaxShownQuery = 40;
constexpr int64_t kJsonShare = 4;  // of the bytes of a message of numbers, which limits count

void SetVariable(const std::string& name, const std::string& value,
                 google::protobuf::Message& message) {
  const google::protobuf::FieldDescriptor* field = message.GetDescriptor()->FindFieldByName(name);
  message.GetReflection()->SetString(&message, field, value);
}

// As gRPC's AnswerFrame, but cached bytes are parsed and written again, away from the threads that
// move bytes.
void AnswerFrameAsJson(server::Api& api, const ExchangePtr& exchange, const std::string& body) {
  v1::GetFrameRequest request;
  const absl::Status read = ReadMethodRequest(*exchange, body, request);
  if (!read.ok()) return exchange->Fail(read);
  exchange->resource = server::ResourceOf(request);
  auto cancel =
      api.GetFrame(std::move(request), exchange->caller.principal.key, exchange->caller.span,
                   [&api, exchange](const absl::StatusOr<server::MadeFrame>& made) {
                     if (!made.ok()) return exchange->Fail(made.status());
                     const absl::Status posted = api.Post([exchange, made] {
                       exchange->FinishBy([&] { return JsonReply(made->frame); });
                     });
                     if (!posted.ok()) exchange->Fail(posted);
                   });
  exchange->cancellation->Arm(1, std::move(cancel));
}

void CallMethod(server::Api& api, const ExchangePtr& exchange,
                const std::shared_ptr<const HeldBody>& body) {
  if (server::IsSame(*exchange->route.method, server::kGetFrame)) {
    return AnswerFrameAsJson(api, exchange, body->bytes());
  }
  api.Call(
      *exchange->route.method, exchange->caller,
      [exchange, body](google::protobuf::Message& request) {
        const absl::Status read = ReadMethodRequest(*exchange, body->bytes(), request);
        if (read.ok()) exchange->resource = server::ResourceOf(request);
        return read;
      },
      [exchange] { return !exchange->cancellation->is_cancelled(); },
      [exchange](const absl::StatusOr<server::MessagePtr>& response) {
        if (!response.ok()) return exchange->Fail(response.status());
        exchange->FinishBy([&] { return JsonReply(**response); });
      });
}

// Gathers a body, then calls the method.
class MethodBody final : public BodySink {
 public:
  MethodBody(server::Api& api, const ExchangePtr& exchange, int64_t max_bytes,
             std::shared_ptr<MemoryBudget> budget)
      : api_(api),
        exchange_(exchange),
        max_bytes_(max_bytes),
        body_(std::make_shared<HeldBody>(std::move(budget))) {}

  void Take(std::string_view piece, bool is_last, absl::AnyInvocable<void()> next) override {
    const ExchangePtr exchange = exchange_.lock();
    if (exchange == nullptr) return;
    const auto size = static_cast<int64_t>(body_->bytes().size() + piece.size());
    if (size > max_bytes_) return exchange->Fail(TooLarge(*exchange, size), 413);
    if (!body_->Append(piece)) {
      return exchange->Fail(
          absl::UnavailableError("too many requests with bodies at a time; try again"));
    }
    if (!is_last) return next();
    CallMethod(api_, exchange, std::exchange(body_, nullptr));
  }

  absl::Status TooLarge(const Exchange& exchange, int64_t size_bytes) const {
    return server::RequestTooLarge(exchange.route.method->name, size_bytes, max_bytes_);
  }

 private:
  server::Api& api_;
  const std::weak_ptr<Exchange> exchange_;  // which owns this
  const int64_t max_bytes_;
  std::shared_ptr<HeldBody> body_;
};

}  // namespace

absl::Status ReadMethodRequest(const Exchange& exchange, const std::string& body,
                               google::protobuf::Message& request) {
  const transcode::HttpRule& rule = *exchange.route.rule;
  LB_RETURN_IF_ERROR(transcode::ParseJson(body, request));
  server::FieldViolations violations;
  for (const transcode::QueryField& field : exchange.fields) {
    if (!rule.body.empty()) {
      violations.Add(field.name.substr(0, kMaxShownQuery), "belongs into the body");
    } else if (field.name == rule.variable) {
      violations.Add(field.name, "is in the path already");
    } else {
      transcode::SetField(field, request, violations);
    }
  }
  LB_RETURN_IF_ERROR(violations.ToStatus());
  if (!rule.variable.empty()) SetVariable(rule.variable, exchange.route.variable, request);
  return absl::OkStatus();
}

void AnswerMethod(server::Api& api, const ExchangePtr& exchange, int64_t max_body_bytes,
                  std::shared_ptr<MemoryBudget> budget) {
  const Request& request = exchange->request;
  if (!request.has_body)
    return CallMethod(api, exchange, std::make_shared<HeldBody>(std::move(budget)));
  const absl::Status type = CheckMediaType(request.content_type, kJson);
  if (!type.ok()) return exchange->Fail(type, 415);
  const int64_t max_message_bytes = exchange->route.method->max_request_bytes;
  const int64_t max_bytes = max_message_bytes > max_body_bytes / kJsonShare
                                ? max_body_bytes
                                : kJsonShare * max_message_bytes;
  auto body = std::make_unique<MethodBody>(api, exchange, max_bytes, std::move(budget));
  if (request.body_bytes > max_bytes) {
    return exchange->Fail(body->TooLarge(*exchange, request.body_bytes), 413);
  }
  exchange->body = std::move(body);
}

}  // namespace liquidblend::http
