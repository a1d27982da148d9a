// SQLite with statuses: a connection, statements, transactions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <variant>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

struct sqlite3;
struct sqlite3_stmt;

namespace liquidblend::store {

// What a statement's ? stand for: NULL, an integer, TEXT, or (Bytes) a BLOB.
struct Bytes {
  std::string value;
};
using SqlValue = std::variant<std::nullptr_t, int64_t, std::string, Bytes>;

// The row that a statement is at; columns from 0.
class SqlRow {
 public:
  explicit SqlRow(sqlite3_stmt* statement) : statement_(statement) {}
  int64_t Int(int column) const;
  std::string String(int column) const;  // TEXT or BLOB; NULL: empty

 private:
  sqlite3_stmt* statement_;
};

// One connection, in WAL mode with synchronous=FULL and foreign keys off.
// Errors of all calls name the database's path: kUnavailable (locked, or the file went away),
// kResourceExhausted (disk or memory full), kDataLoss (not a database, corrupt, the disk fails),
// kPermissionDenied, kInternal (a statement that SQLite does not accept).
// Threads: one at a time.
class Database {
 public:
  // Creates the file if missing.
  static absl::StatusOr<std::unique_ptr<Database>> Open(const std::string& path,
                                                        absl::Duration busy_timeout);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  const std::string& path() const { return path_; }

  // Runs one statement and hands its rows to `each_row`, until that returns an error.
  absl::Status Run(absl::string_view sql, std::initializer_list<SqlValue> values = {},
                   absl::FunctionRef<absl::Status(const SqlRow&)> each_row = IgnoreRow);

  // Runs statements without values, separated by semicolons.
  absl::Status RunScript(const std::string& sql);

  // BEGIN IMMEDIATE, body, COMMIT; ROLLBACK if the body or the commit fails.
  absl::Status Transaction(absl::FunctionRef<absl::Status()> body);

 private:
  Database(std::string path, sqlite3* connection) : path_(std::move(path)), db_(connection) {}
  static absl::Status IgnoreRow(const SqlRow&) { return absl::OkStatus(); }
  absl::Status Configure(absl::Duration busy_timeout);
  absl::Status SwitchToWal(absl::Duration busy_timeout);
  absl::Status Error(int code, absl::string_view action) const;

  std::string path_;
  sqlite3* db_;
};

}  // namespace liquidblend::store
