// The catalog's table of workers. Each function runs inside a transaction of its caller.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// Records that the worker is there. If its name is new, deletes workers that have been gone for a
// day.
absl::Status SaveWorker(Sql& sql, const pb::WorkerRecord& worker, absl::Time now);
// Finds the workers seen at `since` or later, by name.
absl::StatusOr<std::vector<pb::WorkerRecord>> FindWorkers(Sql& sql, absl::Time since);

}  // namespace liquidblend::store
