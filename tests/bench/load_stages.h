// Where the time of a call goes.
#pragma once

#include "absl/status/status.h"
#include "tests/bench/load_clients.h"
#include "tests/bench/load_server.h"

namespace liquidblend::bench {

// One client calls for frames of each preset in turn, uncached; prints a row for each: what the
// server says of its stages, and what remains of what the client sees.
// Errors: the server's, kUnavailable if no frame came.
absl::Status PrintStages(const LoadServer& server, const LoadTarget& target, double seconds);

}  // namespace liquidblend::bench
