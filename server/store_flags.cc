#include "server/store_flags.h"

#include <CLI/CLI.hpp>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/memory_limit.h"

namespace liquidblend::server {

void AddStoreFlags(CLI::App& app, store::StoreLocation& location) {
  app.add_option("--data", location.data,
                 "Directory of everything that is kept, on one machine; needed unless given in "
                 "the environment (Env:LIQUIDBLEND_DATA, which does not count with --store)");
  app.add_option("--store", location.catalog_url,
                 "postgresql://..., shared by many machines; otherwise --data")
      ->envname("LIQUIDBLEND_STORE");
  app.add_option("--blobs", location.blobs_url,
                 "With --store, which needs it: s3://bucket/prefix; none unless given")
      ->envname("LIQUIDBLEND_BLOBS");
  app.add_option(
      "--cache", location.cache,
      "With --store, which needs it: directory for blobs that are in use; none unless given "
      "(Env:LIQUIDBLEND_CACHE)");
  app.add_option("--cache-size", location.cache_bytes, "Disk space for --cache, e.g. 64GiB")
      ->envname("LIQUIDBLEND_CACHE_SIZE")
      ->transform(CLI::AsSizeValue(false))
      ->default_str(base::FormatSize(location.cache_bytes));
}

void AddHistoryFlag(CLI::App& app, std::string& keep_history) {
  app.add_option("--keep-history", keep_history,
                 "How long jobs that have ended are remembered, and their request ids; 0: for ever")
      ->capture_default_str();
}

absl::StatusOr<absl::Duration> ParseDurationFlag(const char* name, const std::string& text) {
  absl::Duration duration;
  absl::string_view days = text;
  int num_days = 0;
  if (absl::ConsumeSuffix(&days, "d") && absl::SimpleAtoi(days, &num_days) && num_days >= 0) {
    return num_days * absl::Hours(24);
  }
  if (absl::ParseDuration(text, &duration) && duration >= absl::ZeroDuration()) return duration;
  return absl::InvalidArgumentError(
      absl::StrCat(name, " must be a duration such as 30d, 24h or 500ms, got '", text, "'"));
}

}  // namespace liquidblend::server
