// A family of a data directory, to measure on what simulations made.
#pragma once

#include "tests/bench/warped_family.h"

namespace liquidblend::bench {

// Whether one is named: by the environment variables LIQUIDBLEND_BENCH_DATA, a data directory, and
// LIQUIDBLEND_BENCH_FAMILY.
bool HasStoredFamily();

// That family at its finest level. Loaded once. Aborts with a message if it cannot be.
// Requires: HasStoredFamily().
const Loaded& StoredFamily();

}  // namespace liquidblend::bench
