// The answer to GET /v1/animations/{animation}/frame.drc (.ply, .obj, .meshopt): a frame as it was
// imported.
#pragma once

#include "server/api/api.h"
#include "server/http/exchange/exchange.h"

namespace liquidblend::http {

// The query has the fields of GetAnimationFrameRequest. The frame's tag follows from its bytes: a
// client that has them gets 304.
void AnswerAnimationFrame(server::Api& api, const ExchangePtr& exchange);

}  // namespace liquidblend::http
