// Connections to one PostgreSQL database, shared by threads.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/store/sql/postgres.h"

namespace liquidblend::store {

// Threads: safe.
class PostgresPool {
 public:
  // Requires: max_connections >= 1.
  PostgresPool(PostgresTarget target, PostgresOptions options, int max_connections)
      : target_(std::move(target)), options_(std::move(options)), num_free_(max_connections) {}

  // Runs `body` with a connection of its own. If the connection turns out to have been lost before
  // the body has done anything with it, the body runs again with another one.
  // Errors: the body's; kUnavailable if no connection is free within the timeout.
  absl::Status Use(absl::FunctionRef<absl::Status(PostgresConnection&)> body)
      ABSL_LOCKS_EXCLUDED(mutex_);

  // Opens one more connection, beside those of the pool.
  absl::StatusOr<std::unique_ptr<PostgresConnection>> Open() const {
    return PostgresConnection::Open(target_, options_);
  }

 private:
  absl::Status Wait() ABSL_LOCKS_EXCLUDED(mutex_);
  std::unique_ptr<PostgresConnection> TakeIdle() ABSL_LOCKS_EXCLUDED(mutex_);
  absl::Status UseOne(absl::FunctionRef<absl::Status(PostgresConnection&)> body);
  void GiveBack(std::unique_ptr<PostgresConnection> connection) ABSL_LOCKS_EXCLUDED(mutex_);

  const PostgresTarget target_;
  const PostgresOptions options_;
  absl::Mutex mutex_;
  int num_free_ ABSL_GUARDED_BY(mutex_);  // how many more may be in use
  std::vector<std::unique_ptr<PostgresConnection>> idle_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::store
