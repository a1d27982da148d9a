// Owner, trace and priority of submitted jobs.
#pragma once

#include <string>

#include "liquidblend/store/v1/records.pb.h"
#include "server/access/principal.h"
#include "server/base/errors.h"

namespace liquidblend::server {

inline constexpr int kMaxPriority = 100;  // and -kMaxPriority is the least

// `field`: the name of the request's field.
void CheckPriority(const std::string& field, int priority, FieldViolations& violations);

// Sets the job's owner, and the trace that it goes on with.
void SetCaller(const Caller& caller, store::v1::JobRecord& job);

}  // namespace liquidblend::server
