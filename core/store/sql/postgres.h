// PostgreSQL with statuses: a connection, statements, transactions, notifications.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/store/sql/postgres_url.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

struct PostgresOptions {
  absl::Duration timeout = absl::Seconds(10);  // of a statement, a lock, an idle transaction
  std::function<absl::Time()> now;             // empty: the database's clock
};

// One connection. It is not opened again once it is lost.
// Errors of all calls name the database: kUnavailable (lost, timed out, locked, restarting),
// kResourceExhausted (disk or memory full), kPermissionDenied, kDataLoss (corrupt),
// kInvalidArgument (text that is not UTF-8 or has a zero byte), kInternal (a statement that the
// server does not accept).
// Threads: one at a time.
class PostgresConnection : public Sql {
 public:
  static absl::StatusOr<std::unique_ptr<PostgresConnection>> Open(const PostgresTarget& target,
                                                                  const PostgresOptions& options);
  ~PostgresConnection() override;
  PostgresConnection(const PostgresConnection&) = delete;
  PostgresConnection& operator=(const PostgresConnection&) = delete;

  const std::string& name() const override;
  absl::StatusOr<absl::Time> Now() override;
  absl::string_view for_update() const override;
  absl::string_view for_update_of_free() const override;

  bool is_open() const;
  // The number of statements that the server has completed.
  int64_t num_done() const { return num_done_; }

  // Runs statements without values, separated by semicolons.
  absl::Status RunScript(const std::string& script);

  // BEGIN, body, COMMIT; ROLLBACK if the body throws or fails. READ COMMITTED: each statement sees
  // what is committed when it begins.
  absl::Status Transaction(absl::FunctionRef<absl::Status()> body);
  // The same with a query as its first statement, which is sent along with BEGIN, so that it costs
  // no round trip. The body gets the first column of its only row, an integer.
  absl::Status TransactionAfter(absl::string_view query,
                                absl::FunctionRef<absl::Status(int64_t)> body);
  // BEGIN, body, COMMIT of statements that only read. REPEATABLE READ: all of them see what is
  // committed when the first one begins. They, and the pauses between them, may take 2 minutes each
  // if options.timeout is less.
  absl::Status Snapshot(absl::FunctionRef<absl::Status()> body);

  // In a transaction: runs statements without values that take locks, each of which may be waited
  // for that long (at most half of options.timeout). Returns false if one was not free in time;
  // then the transaction can only be rolled back.
  absl::StatusOr<bool> TryLock(absl::string_view statements, absl::Duration timeout);

  // Subscribes to the channel's notifications. To be called once.
  absl::Status Listen(const std::string& channel);
  // Waits for a notification since the last call, at most `timeout`; returns whether there was one.
  absl::StatusOr<bool> AwaitNotification(absl::Duration timeout);

 private:
  struct Impl;
  explicit PostgresConnection(std::unique_ptr<Impl> impl);
  absl::Status RunStatement(absl::string_view statement, std::initializer_list<SqlValue> values,
                            EachRow each_row) override;
  absl::Status Configure();
  absl::Status RunBetween(const std::string& begin, bool may_lock,
                          absl::FunctionRef<absl::Status(int64_t)> body);
  // Runs statements without values; returns the first column of the last one's only row, an
  // integer, or 0 if it has no rows.
  absl::StatusOr<int64_t> QueryByScript(const std::string& script);
  void RollBack();
  // Runs `action`, which may throw exceptions of libpqxx, and returns them as statuses.
  absl::Status Guard(absl::string_view what, absl::FunctionRef<void()> action);

  std::unique_ptr<Impl> impl_;
  int64_t num_done_ = 0;
  bool may_lock_ = false;  // in a transaction that may lock rows
};

}  // namespace liquidblend::store
