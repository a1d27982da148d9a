// Answers of the API's methods as JSON.
#pragma once

#include <memory>

#include "server/api/api.h"
#include "server/http/exchange/exchange.h"

namespace liquidblend::http {

// Sets the request message to what body, query and path of the exchange say.
// Errors: kInvalidArgument with the fields at fault.
absl::Status ReadMethodRequest(const Exchange& exchange, const std::string& body,
                               google::protobuf::Message& request);

// Calls the method of the exchange's route once its body is there, and answers with what it gives.
//   max_body_bytes  of the port, whatever the method's limit
//   budget          of the bodies of all requests
// Requires: the route has a method, which is neither WatchOperation nor UploadAnimation.
void AnswerMethod(server::Api& api, const ExchangePtr& exchange, int64_t max_body_bytes,
                  std::shared_ptr<MemoryBudget> budget);

}  // namespace liquidblend::http
