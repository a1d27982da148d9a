// The lines of an answer that grows.
#pragma once

#include <optional>
#include <string>

#include "absl/functional/any_invocable.h"

namespace liquidblend::http {

// Threads: Stop() safe, Next() one at a time.
class LineSource {
 public:
  using Done = absl::AnyInvocable<void(std::optional<std::string>)>;
  virtual ~LineSource() = default;

  // Gives the next line, with its end, or nothing after the last one: at once, or on any thread.
  // Requires: `done` of the call before has been called.
  virtual void Next(Done done) = 0;

  // The server stops: one more line says so.
  virtual void Stop() = 0;
};

}  // namespace liquidblend::http
