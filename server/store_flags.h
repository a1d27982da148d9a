// Flags for the location of the store and for the retention of history, shared by the server and
// liquidblend-admin.
#pragma once

#include <CLI/App.hpp>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/open_store.h"

namespace liquidblend::server {

void AddStoreFlags(CLI::App& app, store::StoreLocation& location);

// --keep-history
void AddHistoryFlag(CLI::App& app, std::string& keep_history);

// "30s", "1h30m", and whole days: "30d".  Errors: kInvalidArgument that names the flag.
absl::StatusOr<absl::Duration> ParseDurationFlag(const char* name, const std::string& text);

}  // namespace liquidblend::server
