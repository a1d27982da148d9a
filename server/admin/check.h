// Check of a store: whether all data can be read, and which are lost.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/parallel/arena.h"
#include "core/store/open_store.h"
#include "server/admin/progress.h"

namespace liquidblend::admin {

struct CheckOptions {
  bool repair = false;
};

// One blob, or one record of the catalog, that is missing or damaged.
struct Damage {
  std::string blob;                    // empty: in the catalog
  absl::Status error;                  // kNotFound: missing
  std::vector<std::string> needed_by;  // "families/x", "animations/y", "jobs/z"
  std::string repair;                  // the repair that was made; empty: none
};

struct CheckReport {
  int64_t num_blobs = 0;
  int64_t num_bytes = 0;
  int64_t num_animations = 0;
  int64_t num_families = 0;
  int64_t num_jobs = 0;
  int64_t num_unreferenced = 0;  // blobs without a reference
  int64_t unreferenced_bytes = 0;
  std::vector<std::string> repaired;  // "animations/x": readable again, and marked so
  std::vector<Damage> damage;         // the catalog's, then in the order of the blobs' ids
};

// Reads every blob and compares it with its name, past any cache; opens the file of each family;
// looks for every blob that is referred to; reads every record, and lets SQLite check its file. The
// store may be in use. With `repair`, which deletes nothing, damaged blobs are moved to quarantine,
// and written again if the cache has them whole; animations whose file is lost are FAILED, with the
// reason, until it is there again. (Abandoned temporary files are removed whenever a store is
// opened.)
// Errors: those of the stores. Damage is not an error; but a blob that cannot be read for now (the
// store is away, or refuses access) ends the check with an error and does not count as damaged.
absl::StatusOr<CheckReport> Check(const store::StoreLocation& location,
                                  const parallel::Arena& arena, Progress& progress,
                                  const CheckOptions& options = {});
// The same of a store that is open, without SQLite's check of its file.
absl::StatusOr<CheckReport> CheckStore(const store::Store& store, const parallel::Arena& arena,
                                       Progress& progress, const CheckOptions& options = {});

}  // namespace liquidblend::admin
