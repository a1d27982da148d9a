#include "core/store/sql/postgres_pool.h"

#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {

absl::Status PostgresPool::Use(absl::FunctionRef<absl::Status(PostgresConnection&)> body) {
  LB_RETURN_IF_ERROR(Wait());
  const absl::Cleanup release = [this] {  // also if the body throws
    const absl::MutexLock lock(&mutex_);
    ++num_free_;
  };
  return UseOne(body);
}

// Counts the caller as one of those who use a connection.
absl::Status PostgresPool::Wait() {
  const absl::MutexLock lock(&mutex_);
  const auto is_free = [](int* num_free) { return *num_free > 0; };
  if (!mutex_.AwaitWithTimeout(absl::Condition(+is_free, &num_free_), options_.timeout)) {
    return absl::UnavailableError(absl::StrCat("database ", target_.name,
                                               ": all connections have been in use for ",
                                               absl::FormatDuration(options_.timeout)));
  }
  --num_free_;
  return absl::OkStatus();
}

absl::Status PostgresPool::UseOne(absl::FunctionRef<absl::Status(PostgresConnection&)> body) {
  // The loss of an idle connection is noticed at its next use.
  while (std::unique_ptr<PostgresConnection> connection = TakeIdle()) {
    const int64_t num_done = connection->num_done();
    const absl::Status status = body(*connection);
    const bool was_lost_before = !connection->is_open() && connection->num_done() == num_done;
    GiveBack(std::move(connection));
    if (!was_lost_before) return status;
  }
  LB_ASSIGN_OR_RETURN(std::unique_ptr<PostgresConnection> connection, Open());
  const absl::Status status = body(*connection);
  GiveBack(std::move(connection));
  return status;
}

std::unique_ptr<PostgresConnection> PostgresPool::TakeIdle() {
  const absl::MutexLock lock(&mutex_);
  if (idle_.empty()) return nullptr;
  std::unique_ptr<PostgresConnection> connection = std::move(idle_.back());
  idle_.pop_back();
  return connection;
}

void PostgresPool::GiveBack(std::unique_ptr<PostgresConnection> connection) {
  if (!connection->is_open()) return;
  const absl::MutexLock lock(&mutex_);
  idle_.push_back(std::move(connection));
}

}  // namespace liquidblend::store
