#include "server/http/answers/upload_answer.h"

#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/http/answers/method_answer.h"
#include "server/http/exchange/media_type.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {
namespace {

constexpr char kTar[] = "application/x-tar";

// What is too large stays so: a client that heeds Retry-After need not send it again.
int CodeOf(const absl::Status& refusal) {
  const std::string reason = server::ReasonOf(refusal);
  return reason == "UPLOAD_TOO_LARGE" || reason == "TOO_MANY_FILES" ? 413 : 0;
}

class UploadBody final : public BodySink {
 public:
  UploadBody(std::shared_ptr<server::ArchiveUpload> upload, const ExchangePtr& exchange)
      : upload_(std::move(upload)), exchange_(exchange) {}

  void Take(std::string_view piece, bool is_last, absl::AnyInvocable<void()> next) override {
    const ExchangePtr exchange = exchange_.lock();
    if (exchange == nullptr) return;
    upload_->Add(std::string(piece), [upload = upload_, exchange, is_last,
                                      next = std::move(next)](const absl::Status& added) mutable {
      if (!added.ok()) return exchange->Fail(added, CodeOf(added));
      is_last ? Submit(*upload, exchange) : next();
    });
  }

 private:
  static void Submit(server::ArchiveUpload& upload, const ExchangePtr& exchange) {
    upload.Submit([exchange](const absl::StatusOr<google::longrunning::Operation>& operation) {
      if (!operation.ok()) return exchange->Fail(operation.status());
      exchange->FinishBy([&] { return JsonReply(*operation); });
    });
  }

  const std::shared_ptr<server::ArchiveUpload> upload_;
  const std::weak_ptr<Exchange> exchange_;  // which owns this
};

}  // namespace

void AnswerUpload(server::Api& api, const ExchangePtr& exchange) {
  v1::UploadAnimationRequest header;
  const absl::Status read = ReadMethodRequest(*exchange, /*body=*/"", header);
  if (!read.ok()) return exchange->Fail(read);
  exchange->resource = server::ResourceOf(header.header());
  if (!header.has_header()) {
    return exchange->Fail(server::InvalidField("header",
                                               "the query must have its fields, such as "
                                               "header.animationId, and no others"));
  }
  const absl::Status type = CheckMediaType(exchange->request.content_type, kTar);
  if (!type.ok()) return exchange->Fail(type, 415);
  if (!exchange->request.has_body) {
    return exchange->Fail(absl::InvalidArgumentError("the body must be a tar archive"));
  }
  exchange->body =
      std::make_unique<UploadBody>(api.OpenUpload(std::move(header), exchange->caller), exchange);
}

}  // namespace liquidblend::http
