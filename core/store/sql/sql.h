// Interface of the catalog's databases: SQL statements with values, rows, statuses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <variant>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {

// A value: NULL, an integer, text, or (Bytes) a string of bytes.
struct Bytes {
  std::string value;
};
using SqlValue = std::variant<std::nullptr_t, int64_t, std::string, Bytes>;

// The current row of a statement; columns are counted from 0.
class SqlRow {
 public:
  virtual ~SqlRow() = default;
  virtual int64_t Int(int column) const = 0;         // NULL: 0
  virtual std::string String(int column) const = 0;  // text or bytes; NULL: empty
};

// One connection to a database. Errors of all calls name it.  Threads: one at a time.
class Sql {
 public:
  using EachRow = absl::FunctionRef<absl::Status(const SqlRow&)>;

  virtual ~Sql() = default;

  // The database's name for messages, without secrets.
  virtual const std::string& name() const = 0;

  // The time by the clock of leases.
  virtual absl::StatusOr<absl::Time> Now() = 0;

  // Suffixes of a SELECT that lock its rows until the transaction ends; the second one skips rows
  // that others have locked.
  virtual absl::string_view for_update() const { return ""; }
  virtual absl::string_view for_update_of_free() const { return ""; }

  // Suffix of a SELECT's table that makes the database use this index.
  virtual std::string indexed_by(absl::string_view) const { return ""; }

  // Runs one statement and hands its rows to `each_row`, until that returns an error. `values`
  // stand for $1, $2, ..., each of which is used first in this order.
  absl::Status Run(absl::string_view statement, std::initializer_list<SqlValue> values = {},
                   EachRow each_row = IgnoreRow) {
    return RunStatement(statement, values, each_row);
  }

 protected:
  virtual absl::Status RunStatement(absl::string_view statement,
                                    std::initializer_list<SqlValue> values, EachRow each_row) = 0;

 private:
  static absl::Status IgnoreRow(const SqlRow&) { return absl::OkStatus(); }
};

// The first column of a statement's last row, an integer; 0 if there is none.
inline absl::StatusOr<int64_t> QueryInt(Sql& sql, absl::string_view statement,
                                        std::initializer_list<SqlValue> values = {}) {
  int64_t result = 0;
  LB_RETURN_IF_ERROR(sql.Run(statement, values, [&](const SqlRow& row) {
    result = row.Int(0);
    return absl::OkStatus();
  }));
  return result;
}

}  // namespace liquidblend::store
