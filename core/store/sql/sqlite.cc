#include "core/store/sql/sqlite.h"

#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <limits>
#include <system_error>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/posix_file.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"

namespace liquidblend::store {
namespace {

struct Finalize {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

absl::StatusCode CodeOf(int extended_code) {
  if (extended_code == SQLITE_IOERR_CORRUPTFS || extended_code == SQLITE_IOERR_DATA) {
    return absl::StatusCode::kDataLoss;
  }
  if (extended_code == SQLITE_READONLY_DBMOVED) return absl::StatusCode::kUnavailable;
  switch (extended_code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
    case SQLITE_PROTOCOL:
      return absl::StatusCode::kUnavailable;
    case SQLITE_FULL:
    case SQLITE_NOMEM:
      return absl::StatusCode::kResourceExhausted;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return absl::StatusCode::kDataLoss;
    case SQLITE_PERM:
    case SQLITE_AUTH:
    case SQLITE_READONLY:
      return absl::StatusCode::kPermissionDenied;
    default:
      return absl::StatusCode::kInternal;
  }
}

int Length(absl::string_view text) {
  constexpr size_t kMax = std::numeric_limits<int>::max();
  return static_cast<int>(std::min(text.size(), kMax));
}

int BindValue(sqlite3_stmt* statement, int index, const SqlValue& value) {
  if (const auto* number = std::get_if<int64_t>(&value)) {
    return sqlite3_bind_int64(statement, index, *number);
  }
  if (const auto* text = std::get_if<std::string>(&value)) {
    return sqlite3_bind_text64(statement, index, text->data(), text->size(), SQLITE_STATIC,
                               SQLITE_UTF8);
  }
  if (const auto* bytes = std::get_if<Bytes>(&value)) {
    return sqlite3_bind_blob64(statement, index, bytes->value.data(), bytes->value.size(),
                               SQLITE_STATIC);
  }
  return sqlite3_bind_null(statement, index);
}

class SqliteRow : public SqlRow {
 public:
  explicit SqliteRow(sqlite3_stmt* statement) : statement_(statement) {}

  int64_t Int(int column) const override { return sqlite3_column_int64(statement_, column); }
  std::string String(int column) const override {
    const void* const start = sqlite3_column_blob(statement_, column);
    const int size = sqlite3_column_bytes(statement_, column);
    return start == nullptr
               ? std::string()
               : std::string(static_cast<const char*>(start), static_cast<size_t>(size));
  }

 private:
  sqlite3_stmt* statement_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Database>> Database::Open(const std::string& path,
                                                         absl::Duration busy_timeout,
                                                         std::function<absl::Time()> now) {
  sqlite3* connection = nullptr;
  errno = 0;
  const int code = sqlite3_open_v2(
      path.c_str(), &connection,
      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE,
      nullptr);
  std::unique_ptr<Database> database(new Database(path, std::move(now), connection));
  if (code != SQLITE_OK) return database->Error(code, "open");
  LB_RETURN_IF_ERROR(database->Configure(busy_timeout));
  return database;
}

Database::~Database() { sqlite3_close(db_); }

std::string Database::indexed_by(absl::string_view index) const {
  return absl::StrCat("INDEXED BY ", index);
}

// Not absl::Now(): where the clock is set, that may tell the former time for a while, in one
// process and not in another, and two workers would take each other's leases for lapsed.
absl::StatusOr<absl::Time> Database::Now() {
  return now_ ? now_() : absl::FromChrono(std::chrono::system_clock::now());
}

absl::Status Database::Configure(absl::Duration busy_timeout) {
  const int64_t busy_ms =
      std::min<int64_t>(absl::ToInt64Milliseconds(busy_timeout), std::numeric_limits<int>::max());
  sqlite3_busy_timeout(db_, static_cast<int>(busy_ms));
  // A damaged file must not be able to do more than fail.
  LB_RETURN_IF_ERROR(RunScript("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON;"));
  LB_RETURN_IF_ERROR(SwitchToWal(busy_timeout));
  return RunScript("PRAGMA synchronous = FULL;");
}

// Two processes that open a new database at once get in each other's way here, and SQLite does not
// wait on its own where it could mean a deadlock.
absl::Status Database::SwitchToWal(absl::Duration busy_timeout) {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  std::string mode;
  const auto attempt = [&] {
    return Run("PRAGMA journal_mode = WAL", {}, [&](const SqlRow& row) {
      mode = row.String(0);
      return absl::OkStatus();
    });
  };
  absl::Status status = attempt();
  while (absl::IsUnavailable(status) && base::Since(begin) < busy_timeout) {
    absl::SleepFor(absl::Milliseconds(5));
    status = attempt();
  }
  LB_RETURN_IF_ERROR(status);
  if (mode == "wal") return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("database ", path_,
                   ": its file system does not allow write-ahead logging (mode ", mode, ")"));
}

absl::Status Database::RunStatement(absl::string_view sql, std::initializer_list<SqlValue> values,
                                    EachRow each_row) {
  sqlite3_stmt* prepared = nullptr;
  int code = sqlite3_prepare_v2(db_, sql.data(), Length(sql), &prepared, nullptr);
  const Statement statement(prepared);
  if (code != SQLITE_OK) return Error(code, "prepare");
  int index = 0;
  for (const SqlValue& value : values) {
    code = BindValue(statement.get(), ++index, value);
    if (code != SQLITE_OK) return Error(code, "bind");
  }
  errno = 0;
  while ((code = sqlite3_step(statement.get())) == SQLITE_ROW) {
    LB_RETURN_IF_ERROR(each_row(SqliteRow(statement.get())));
  }
  return code == SQLITE_DONE ? absl::OkStatus() : Error(code, "run");
}

absl::Status Database::RunScript(const std::string& sql) {
  errno = 0;
  const int code = sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? absl::OkStatus() : Error(code, "run");
}

absl::Status Database::Transaction(absl::FunctionRef<absl::Status()> body) {
  RollBack();  // what could not be rolled back before, for lack of memory
  LB_RETURN_IF_ERROR(Run("BEGIN IMMEDIATE"));
  const absl::Cleanup end = [this] { RollBack(); };  // also if the body throws
  LB_RETURN_IF_ERROR(body());
  return Run("COMMIT");
}

// SQLite has rolled back already where an error left it no choice.
void Database::RollBack() {
  if (sqlite3_get_autocommit(db_) != 0) return;
  sqlite3_exec(db_, "ROLLBACK", nullptr, nullptr, nullptr);  // does not throw
}

absl::Status Database::Error(int code, absl::string_view action) const {
  const int failed_call = errno;  // SQLite forgets it when the COMMIT fails
  absl::StatusCode status_code = CodeOf(code);
  std::string detail = sqlite3_errmsg(db_);
  const int primary = code & 0xff;
  if (primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN) {
    int error_number = db_ == nullptr ? 0 : sqlite3_system_errno(db_);
    if (error_number == 0) error_number = failed_call;
    const absl::Status cause = base::ErrnoStatus(error_number, "", path_);
    if (error_number != 0 && !absl::IsNotFound(cause)) status_code = cause.code();
    if (code == SQLITE_IOERR_READ && error_number == EIO) status_code = absl::StatusCode::kDataLoss;
    absl::StrAppend(&detail, ", ", std::generic_category().message(error_number));
  }
  return absl::Status(
      status_code, absl::StrCat("database ", path_, ": ", action, ": ", detail, " (", code, ")"));
}

}  // namespace liquidblend::store
