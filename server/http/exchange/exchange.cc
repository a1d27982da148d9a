#include "server/http/exchange/exchange.h"

#include "server/base/errors.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {

void Exchange::Fail(const absl::Status& error, int http_code) {
  const absl::Status told =
      resource.empty() ? error : server::WithMetadata(error, {{"resource", resource}});
  Finish(ErrorReply(told, http_code));
}

}  // namespace liquidblend::http
