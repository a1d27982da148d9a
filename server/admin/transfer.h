// Export and import of a whole store (docs/formats.md, "Export").
#pragma once

#include <cstdint>
#include <istream>
#include <ostream>
#include <string>

#include "absl/status/statusor.h"
#include "core/parallel/arena.h"
#include "core/store/open_store.h"
#include "server/admin/progress.h"

namespace liquidblend::admin {

struct TransferReport {
  int64_t num_animations = 0;
  int64_t num_families = 0;
  int64_t num_jobs = 0;  // and children; those that are not done are queued again
  int64_t num_copied = 0;
  int64_t copied_bytes = 0;
  int64_t num_skipped = 0;  // blobs that existed already
};

// Exports a snapshot of the store, which may be in use. Blobs are verified when they are read, and
// the written bytes are compared with their names. A repeated call copies only missing blobs.
// Errors: kDataLoss if a blob or a record cannot be read, naming it (Check() tells more);
// kFailedPrecondition if `directory` is a data directory; those of the stores.
absl::StatusOr<TransferReport> ExportToDirectory(const store::Store& store,
                                                 const std::string& directory,
                                                 const parallel::Arena& arena, Progress& progress);
// The same as a tar archive of such a directory, the catalog last.
absl::StatusOr<TransferReport> ExportToStream(const store::Store& store, std::ostream& out,
                                              Progress& progress);

// Imports an export: first the blobs, except for those that exist and were committed within kKept,
// by the clock of the store; then all records or none. After an error a repeated call continues. If
// the lists of the store lag, it copies all of them once more.
// Errors: kAlreadyExists if a name is taken in the store, naming it; kDataLoss if the export is
// damaged or incomplete; kInvalidArgument if it is not an export, or of an unknown version.
inline constexpr absl::Duration kKept = absl::Hours(12);
absl::StatusOr<TransferReport> ImportFromDirectory(const std::string& directory,
                                                   const store::Store& store,
                                                   const parallel::Arena& arena,
                                                   Progress& progress);
// Imports from a tar archive of such a directory, in any order of its files.
absl::StatusOr<TransferReport> ImportFromStream(std::istream& in, const store::Store& store,
                                                Progress& progress);

}  // namespace liquidblend::admin
