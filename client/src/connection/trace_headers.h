// Trace of a call, as metadata.
#pragma once

#include <grpcpp/client_context.h>

#include "liquidblend/client.h"

namespace liquidblend::client {

// Leaves out what gRPC would end the program for.
void AddTrace(const TraceHeaders& trace, grpc::ClientContext* context);

}  // namespace liquidblend::client
