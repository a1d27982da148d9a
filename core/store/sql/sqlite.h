// SQLite with statuses: a connection, statements, transactions.
#pragma once

#include <functional>
#include <initializer_list>
#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/store/sql/sql.h"

struct sqlite3;

namespace liquidblend::store {

// One connection, in WAL mode with synchronous=FULL and foreign keys off.
// Errors of all calls name the database's path: kUnavailable (locked, or the file went away),
// kResourceExhausted (disk or memory full), kDataLoss (not a database, corrupt, the disk fails),
// kPermissionDenied, kInternal (a statement that SQLite does not accept).
// Threads: one at a time.
class Database : public Sql {
 public:
  // Creates the file if missing. An empty `now` stands for the system's clock.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path,
                                                        absl::Duration busy_timeout,
                                                        std::function<absl::Time()> now = {});
  ~Database() override;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  const std::string& name() const override { return path_; }
  absl::StatusOr<absl::Time> Now() override;
  std::string indexed_by(absl::string_view index) const override;

  // Runs statements without values, separated by semicolons.
  absl::Status RunScript(const std::string& sql);

  // BEGIN IMMEDIATE, body, COMMIT; ROLLBACK if the body throws or fails, or the commit fails.
  absl::Status Transaction(absl::FunctionRef<absl::Status()> body);

 private:
  Database(std::string path, std::function<absl::Time()> now, sqlite3* connection)
      : path_(std::move(path)), now_(std::move(now)), db_(connection) {}
  absl::Status RunStatement(absl::string_view statement, std::initializer_list<SqlValue> values,
                            EachRow each_row) override;
  absl::Status Configure(absl::Duration busy_timeout);
  void RollBack();
  absl::Status SwitchToWal(absl::Duration busy_timeout);
  absl::Status Error(int code, absl::string_view action) const;

  std::string path_;
  std::function<absl::Time()> now_;
  sqlite3* db_;
};

}  // namespace liquidblend::store
