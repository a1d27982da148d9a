// Table of the methods with one request and one response that run to their end on a pool: what
// handlers.h has, without the types of the messages.
#pragma once

#include <google/protobuf/message.h>

#include <memory>

#include "absl/status/statusor.h"
#include "server/access/principal.h"
#include "server/api/methods.h"
#include "server/base/work_pool.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

using MessagePtr = std::unique_ptr<google::protobuf::Message>;

struct UnaryMethod {
  const Method* method;
  WorkPool Backends::*pool;  // where it may block
  MessagePtr (*new_request)();
  // Requires: the request is of new_request()'s type.  Errors: the handler's.  Threads: safe.
  absl::StatusOr<MessagePtr> (*handle)(Backends& backends, const google::protobuf::Message& request,
                                       const Caller& caller);
};

// Null if there is none of this name.
const UnaryMethod* FindUnaryMethod(absl::string_view name);

}  // namespace liquidblend::server
