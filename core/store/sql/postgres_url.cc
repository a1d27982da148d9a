#include "core/store/sql/postgres_url.h"

#include <libpq-fe.h>

#include <algorithm>
#include <map>
#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace liquidblend::store {
namespace {

struct FreeOptions {
  void operator()(PQconninfoOption* options) const { PQconninfoFree(options); }
};

std::string NameOf(const std::map<std::string, std::string>& values) {
  const auto get = [&](const char* key) {
    const auto found = values.find(key);
    return found == values.end() ? std::string() : found->second;
  };
  std::string name = "postgresql://";
  if (!get("user").empty()) absl::StrAppend(&name, get("user"), "@");
  absl::StrAppend(&name, get("host").empty() ? get("hostaddr") : get("host"));
  if (!get("port").empty()) absl::StrAppend(&name, ":", get("port"));
  return absl::StrCat(name, "/", get("dbname"));
}

}  // namespace

absl::StatusOr<PostgresTarget> ParsePostgresUrl(const std::string& url, absl::Duration timeout) {
  const bool is_url =
      absl::StartsWith(url, "postgresql://") || absl::StartsWith(url, "postgres://");
  const std::unique_ptr<PQconninfoOption, FreeOptions> options(
      is_url ? PQconninfoParse(url.c_str(), nullptr) : nullptr);
  if (options == nullptr) {
    return absl::InvalidArgumentError(
        "the url of a PostgreSQL database must be postgresql://user@host:port/database with what "
        "libpq knows behind a ?; this one (not shown, it may hold a password) is not");
  }
  const int64_t seconds = std::max<int64_t>(2, absl::ToInt64Seconds(timeout));
  std::map<std::string, std::string> values = {
      {"application_name", "liquidblend"},
      {"connect_timeout", absl::StrCat(seconds)},
      {"keepalives_idle", absl::StrCat(seconds)},
      {"keepalives_interval", "2"},
      {"keepalives_count", "3"},
      {"tcp_user_timeout", absl::StrCat(1000 * seconds)},
      {"client_encoding", "UTF8"},
  };
  for (const PQconninfoOption* option = options.get(); option->keyword != nullptr; ++option) {
    if (option->val != nullptr) values[option->keyword] = option->val;
  }
  PostgresTarget target;
  target.name = NameOf(values);
  for (const auto& [key, value] : values) {
    absl::StrAppend(&target.conninfo, key, "='",
                    absl::StrReplaceAll(value, {{"\\", "\\\\"}, {"'", "\\'"}}), "' ");
  }
  return target;
}

}  // namespace liquidblend::store
