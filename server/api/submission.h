// What every submission of work has: whose it is, and how urgent.
#pragma once

#include <string>

#include "liquidblend/store/v1/records.pb.h"
#include "server/access/principal.h"
#include "server/base/errors.h"

namespace liquidblend::server {

inline constexpr int kMaxPriority = 100;  // and -kMaxPriority is the least

// `field`: what the request calls it.
void CheckPriority(const std::string& field, int priority, FieldViolations& violations);

// Notes in the job who asks for it.
void SetOwner(const Principal& principal, store::v1::JobRecord& job);

}  // namespace liquidblend::server
