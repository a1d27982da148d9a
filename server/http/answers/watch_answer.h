// The answer to WatchOperation: a line of JSON for each change of the operation.
#pragma once

#include "server/api/api.h"
#include "server/http/exchange/exchange.h"

namespace liquidblend::http {

// Answers once the operation has been found. The lines are protobuf's JSON of Operation; the last
// one is done, or is {"error": google.rpc.Status}.
void AnswerWatch(server::Api& api, const ExchangePtr& exchange);

}  // namespace liquidblend::http
