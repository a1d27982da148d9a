// Everything that a store holds, on its way to another one (docs/formats.md, "Export").
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
  int64_t num_jobs = 0;  // and parts; those that are not done are queued again
  int64_t num_copied = 0;
  int64_t copied_bytes = 0;
  int64_t num_skipped = 0;  // blobs that were there already
};

// The store may be in use: what is exported is what there was at one moment. Its blobs are verified
// when they are read, and what is written is compared with their names. Called again, copies only
// what is missing.
// Errors: kDataLoss if a blob or a record cannot be read, naming it (Check() tells more);
// kFailedPrecondition if `directory` is a data directory; those of the stores.
absl::StatusOr<TransferReport> ExportToDirectory(const store::Store& store,
                                                 const std::string& directory,
                                                 const parallel::Arena& arena, Progress& progress);
// The same as a tar archive of such a directory, the catalog last.
absl::StatusOr<TransferReport> ExportToStream(const store::Store& store, std::ostream& out,
                                              Progress& progress);

// Adds what was exported: first the blobs, except for those that are there and were committed
// within kKept; then all records at once, or none. Called again after an error, goes on. Errors:
// kAlreadyExists if a name is taken in the store, naming it; kDataLoss if the export is damaged or
// not complete; kInvalidArgument if it is none, or of a version that is not known.
inline constexpr absl::Duration kKept = absl::Hours(12);
absl::StatusOr<TransferReport> ImportFromDirectory(const std::string& directory,
                                                   const store::Store& store,
                                                   const parallel::Arena& arena,
                                                   Progress& progress);
// From an archive of such a directory, whatever the order of its files.
absl::StatusOr<TransferReport> ImportFromStream(std::istream& in, const store::Store& store,
                                                Progress& progress);

}  // namespace liquidblend::admin
