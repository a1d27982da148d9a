// Urls of PostgreSQL databases: connection strings for libpq, and names for messages.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace liquidblend::store {

struct PostgresTarget {
  std::string conninfo;  // for libpq; holds the password
  std::string name;      // postgresql://user@host:port/database, for messages; without the password
};

// Parses a url. A lost network is noticed after `timeout`, unless the url has its own settings for
// that.
// Errors: kInvalidArgument if libpq cannot read the url; the message does not show it, since it may
// hold a password.
absl::StatusOr<PostgresTarget> ParsePostgresUrl(const std::string& url, absl::Duration timeout);

}  // namespace liquidblend::store
