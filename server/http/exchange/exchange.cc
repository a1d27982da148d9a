#include "server/http/exchange/exchange.h"

#include <new>
#include <utility>

#include "server/base/errors.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {

void Exchange::Fail(const absl::Status& error, int http_code) {
  try {
    const absl::Status told =
        resource.empty() ? error : server::WithMetadata(error, {{"resource", resource}});
    return Finish(ErrorReply(told, http_code));
  } catch (const std::bad_alloc&) {
    // Below.
  }
  Response response;
  response.code = http_code == 0 ? HttpCode(error.code()) : http_code;
  Finish(std::move(response));
}

}  // namespace liquidblend::http
