// The answer to UploadAnimation: the body is a tar archive, the query has the header.
#pragma once

#include "server/api/api.h"
#include "server/http/exchange/exchange.h"

namespace liquidblend::http {

// Takes the body piece by piece; the next one is read once the one before has been stored. So an
// upload of any size takes the memory of a piece.
void AnswerUpload(server::Api& api, const ExchangePtr& exchange);

}  // namespace liquidblend::http
