#include "core/store/sql/postgres.h"

#include <algorithm>
#include <new>
#include <optional>
#include <pqxx/pqxx>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

constexpr int kByteaType = 17;  // its oid, pg_type.h
constexpr char kLockNotAvailable[] = "55P03";
// The time limit of a statement of a snapshot, and of a pause between two of them, unless the
// options have a longer one. A snapshot holds no locks, and may read a whole catalog from a
// database that is busy.
constexpr absl::Duration kSnapshotTimeout = absl::Minutes(2);

class Listener : public pqxx::notification_receiver {
 public:
  Listener(pqxx::connection_base& connection, const std::string& channel)
      : pqxx::notification_receiver(connection, channel) {}
  void operator()(const std::string&, int) override {}
};

// See "PostgreSQL Error Codes" in its manual.
absl::StatusCode CodeOf(const std::string& sqlstate) {
  const std::string group = sqlstate.substr(0, 2);
  if (group == "08" || group == "40" || group == "57") return absl::StatusCode::kUnavailable;
  if (sqlstate == kLockNotAvailable) return absl::StatusCode::kUnavailable;
  if (sqlstate == "53300") return absl::StatusCode::kUnavailable;  // too_many_connections
  if (sqlstate == "25006") return absl::StatusCode::kUnavailable;  // a standby, read only
  if (group == "53") return absl::StatusCode::kResourceExhausted;
  if (group == "28" || sqlstate == "42501") return absl::StatusCode::kPermissionDenied;
  if (sqlstate == "XX001" || sqlstate == "XX002") return absl::StatusCode::kDataLoss;
  if (sqlstate == "22021" || sqlstate == "22P05") return absl::StatusCode::kInvalidArgument;
  return absl::StatusCode::kInternal;
}

// libpqxx 6 leaves the state out of some errors that have a type of their own.
absl::StatusCode CodeOf(const pqxx::sql_error& error) {
  if (dynamic_cast<const pqxx::insufficient_privilege*>(&error) != nullptr) {
    return absl::StatusCode::kPermissionDenied;
  }
  if (dynamic_cast<const pqxx::insufficient_resources*>(&error) != nullptr) {
    return absl::StatusCode::kResourceExhausted;
  }
  return CodeOf(error.sqlstate());
}

std::string FirstLine(absl::string_view text) {
  return std::string(absl::StripTrailingAsciiWhitespace(text.substr(0, text.find('\n'))));
}

// As a time limit: at least 1, since 0 stands for none.
int64_t ToMilliseconds(absl::Duration timeout) {
  return std::max<int64_t>(1, absl::ToInt64Milliseconds(timeout));
}

std::string SetLockTimeout(absl::Duration timeout) {
  return absl::StrCat("SET LOCAL lock_timeout = ", ToMilliseconds(timeout));
}

class PostgresRow : public SqlRow {
 public:
  explicit PostgresRow(pqxx::row row) : row_(std::move(row)) {}

  int64_t Int(int column) const override {
    int64_t value = 0;
    return absl::SimpleAtoi(Text(column), &value) ? value : 0;
  }
  std::string String(int column) const override {
    const pqxx::field field = row_[column];
    if (field.is_null() || field.type() != kByteaType) return std::string(Text(column));
    return pqxx::binarystring(field).str();
  }

 private:
  absl::string_view Text(int column) const {
    const pqxx::field field = row_[column];
    return absl::string_view(field.c_str(), field.size());
  }
  pqxx::row row_;
};

// As libpq takes it; none: NULL.
std::optional<std::string> ToText(const SqlValue& value) {
  if (const auto* number = std::get_if<int64_t>(&value)) return absl::StrCat(*number);
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* bytes = std::get_if<Bytes>(&value)) {
    return absl::StrCat("\\x", absl::BytesToHexString(bytes->value));
  }
  return std::nullopt;
}

}  // namespace

struct PostgresConnection::Impl {
  std::string name;
  PostgresOptions options;
  std::unique_ptr<pqxx::connection> connection;
  std::unique_ptr<Listener> listener;  // goes before the connection
};

PostgresConnection::PostgresConnection(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

PostgresConnection::~PostgresConnection() = default;

absl::StatusOr<std::unique_ptr<PostgresConnection>> PostgresConnection::Open(
    const PostgresTarget& target, const PostgresOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->name = target.name;
  impl->options = options;
  std::unique_ptr<PostgresConnection> connection(new PostgresConnection(std::move(impl)));
  LB_RETURN_IF_ERROR(connection->Guard("connect", [&] {
    connection->impl_->connection = std::make_unique<pqxx::connection>(target.conninfo);
  }));
  LB_RETURN_IF_ERROR(connection->Configure());
  return connection;
}

// A server that loses its client in the middle must not keep the client's locks.
absl::Status PostgresConnection::Configure() {
  const int64_t ms = ToMilliseconds(impl_->options.timeout);
  return RunScript(absl::StrCat("SET statement_timeout = ", ms, "; SET lock_timeout = ", ms,
                                "; SET idle_in_transaction_session_timeout = ", ms));
}

const std::string& PostgresConnection::name() const { return impl_->name; }

absl::StatusOr<absl::Time> PostgresConnection::Now() {
  if (impl_->options.now) return impl_->options.now();
  LB_ASSIGN_OR_RETURN(
      const int64_t now_us,
      QueryInt(*this, "SELECT (extract(epoch FROM clock_timestamp()) * 1000000)::bigint"));
  return absl::FromUnixMicros(now_us);
}

absl::string_view PostgresConnection::for_update() const { return may_lock_ ? " FOR UPDATE" : ""; }

absl::string_view PostgresConnection::for_update_of_free() const {
  return may_lock_ ? " FOR UPDATE SKIP LOCKED" : "";
}

bool PostgresConnection::is_open() const {
  return impl_->connection != nullptr && impl_->connection->is_open();
}

absl::Status PostgresConnection::RunStatement(absl::string_view statement,
                                              std::initializer_list<SqlValue> values,
                                              EachRow each_row) {
  std::vector<std::optional<std::string>> texts;
  std::vector<const char*> pointers;
  for (const SqlValue& value : values) texts.push_back(ToText(value));
  for (const std::optional<std::string>& text : texts) {
    if (text.has_value() && absl::StrContains(*text, '\0')) {
      return absl::InvalidArgumentError(
          absl::StrCat("database ", name(), ": text with a zero byte"));
    }
    pointers.push_back(text.has_value() ? text->c_str() : nullptr);
  }
  pqxx::result rows;
  LB_RETURN_IF_ERROR(Guard("run", [&] {
    pqxx::nontransaction work(*impl_->connection);
    rows = work.exec_params(std::string(statement), pqxx::prepare::make_dynamic_params(pointers));
  }));
  for (const pqxx::row& row : rows) LB_RETURN_IF_ERROR(each_row(PostgresRow(row)));
  return absl::OkStatus();
}

absl::Status PostgresConnection::RunScript(const std::string& script) {
  return QueryByScript(script).status();
}

absl::StatusOr<int64_t> PostgresConnection::QueryByScript(const std::string& script) {
  pqxx::result rows;
  LB_RETURN_IF_ERROR(Guard("run", [&] {
    pqxx::nontransaction work(*impl_->connection);
    rows = work.exec(script);
  }));
  return rows.empty() || rows.columns() == 0 ? 0 : PostgresRow(rows.front()).Int(0);
}

absl::Status PostgresConnection::Transaction(absl::FunctionRef<absl::Status()> body) {
  return RunBetween("BEGIN", /*may_lock=*/true, [&](int64_t) { return body(); });
}

absl::Status PostgresConnection::TransactionAfter(absl::string_view query,
                                                  absl::FunctionRef<absl::Status(int64_t)> body) {
  return RunBetween(absl::StrCat("BEGIN; ", query), /*may_lock=*/true, body);
}

absl::Status PostgresConnection::Snapshot(absl::FunctionRef<absl::Status()> body) {
  const int64_t ms = ToMilliseconds(std::max(impl_->options.timeout, kSnapshotTimeout));
  return RunBetween(absl::StrCat("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY; "
                                 "SET LOCAL statement_timeout = ",
                                 ms, "; SET LOCAL idle_in_transaction_session_timeout = ", ms),
                    /*may_lock=*/false, [&](int64_t) { return body(); });
}

absl::Status PostgresConnection::RunBetween(const std::string& begin, bool may_lock,
                                            absl::FunctionRef<absl::Status(int64_t)> body) {
  absl::Cleanup roll_back = [this] { RollBack(); };  // also if the body throws
  LB_ASSIGN_OR_RETURN(const int64_t first, QueryByScript(begin));
  may_lock_ = may_lock;
  LB_RETURN_IF_ERROR(body(first));
  std::move(roll_back).Cancel();
  may_lock_ = false;
  const absl::Status status = RunScript("COMMIT");
  if (status.ok() || is_open() || !may_lock) return status;
  return absl::Status(status.code(),
                      absl::StrCat(status.message(), "; whether the change is done is not known"));
}

// A connection that cannot even roll back is closed: its next user would continue the transaction.
void PostgresConnection::RollBack() {
  may_lock_ = false;
  if (!is_open()) return;
  try {
    if (RunScript("ROLLBACK").ok()) return;
  } catch (const std::exception&) {  // no memory for the error
  }
  impl_->connection->disconnect();
}

absl::StatusOr<bool> PostgresConnection::TryLock(absl::string_view statements,
                                                 absl::Duration timeout) {
  const std::string script =
      absl::StrCat(SetLockTimeout(std::min(timeout, impl_->options.timeout / 2)), "; ", statements,
                   "; ", SetLockTimeout(impl_->options.timeout));
  bool is_locked = false;
  LB_RETURN_IF_ERROR(Guard("lock", [&] {
    pqxx::nontransaction work(*impl_->connection);
    try {
      work.exec(script);
      is_locked = true;
    } catch (const pqxx::sql_error& error) {
      if (error.sqlstate() != kLockNotAvailable) throw;
    }
  }));
  return is_locked;
}

absl::Status PostgresConnection::Listen(const std::string& channel) {
  return Guard("listen",
               [&] { impl_->listener = std::make_unique<Listener>(*impl_->connection, channel); });
}

absl::StatusOr<bool> PostgresConnection::AwaitNotification(absl::Duration timeout) {
  int num_heard = 0;
  LB_RETURN_IF_ERROR(Guard("await notification", [&] {
    const timespec time = absl::ToTimespec(std::max(timeout, absl::ZeroDuration()));
    num_heard = impl_->connection->await_notification(time.tv_sec, time.tv_nsec / 1000);
  }));
  return num_heard > 0;
}

absl::Status PostgresConnection::Guard(absl::string_view what, absl::FunctionRef<void()> action) {
  absl::StatusCode code = absl::StatusCode::kInternal;
  std::string detail;
  try {
    action();
    ++num_done_;
    return absl::OkStatus();
  } catch (const pqxx::sql_error& error) {
    code = CodeOf(error);
    detail = FirstLine(error.what());
  } catch (const pqxx::transaction_rollback& error) {  // deadlocks
    code = absl::StatusCode::kUnavailable;
    detail = FirstLine(error.what());
  } catch (const pqxx::broken_connection& error) {
    code = absl::StatusCode::kUnavailable;
    detail = FirstLine(error.what());
  } catch (const std::bad_alloc&) {
    code = absl::StatusCode::kResourceExhausted;
    detail = "out of memory";
  } catch (const std::exception& error) {
    detail = FirstLine(error.what());
  }
  if (code == absl::StatusCode::kInternal && !is_open()) code = absl::StatusCode::kUnavailable;
  return absl::Status(code, absl::StrCat("database ", name(), ": ", what, ": ", detail));
}

}  // namespace liquidblend::store
