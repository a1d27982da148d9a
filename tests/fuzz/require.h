// Promises that the fuzzers check.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace liquidblend::fuzz {

// Ends the process if the promise is broken, so that libFuzzer and the replay test see it.
inline void Require(bool condition, const char* promise) {
  if (condition) return;
  std::fprintf(stderr, "a promise is broken: %s\n", promise);
  std::abort();
}

}  // namespace liquidblend::fuzz
