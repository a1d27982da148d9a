// The catalog on any database that runs its transactions.
#pragma once

#include <cstdint>
#include <memory>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// A database with the catalog's tables. Errors: the body's, or as Catalog's.
// Threads: safe; concurrent calls get connections of their own, or wait for their turn.
class SqlBackend {
 public:
  using Body = absl::FunctionRef<absl::Status(Sql&)>;

  virtual ~SqlBackend() = default;
  // Runs statements that change nothing; each sees all committed changes.
  virtual absl::Status Read(Body body) = 0;
  // The same, for lists that must lack nothing. Errors: kFailedPrecondition if the tables are not
  // of this program's version before or after the body, since newer tables may have more to list.
  virtual absl::Status ReadCurrent(Body body) = 0;
  // ReadCurrent() whose statements all see the changes that are committed when the first one
  // begins.
  virtual absl::Status ReadSnapshot(Body body) = 0;
  // Runs a transaction; durable when it returns OK. No other Change() or ChangeShared() runs
  // meanwhile, on any machine.
  virtual absl::Status Change(Body body) = 0;
  // Runs a transaction beside others, but not beside a Change(): the body changes one leased job,
  // its parent (found with Sql::for_update), and the animation or family that it is for.
  virtual absl::Status ChangeShared(Body body) = 0;
  // Runs a transaction beside others: the body changes one job that it found with Sql::for_update.
  virtual absl::Status ChangeJob(Body body) = 0;
  // See Catalog::WaitForJob(). `until_next` is a Read() that returns the time until the next job
  // may be leased: 0 if there is one.
  using UntilNextJob = absl::FunctionRef<absl::StatusOr<absl::Duration>()>;
  virtual absl::StatusOr<bool> WaitForJob(absl::Duration timeout, UntilNextJob until_next) = 0;
};

// Whether a program that knows these versions of the tables may use a database with this one.
// Errors: kFailedPrecondition, naming the database and the versions.
absl::Status CheckTablesVersion(const Sql& sql, int64_t version, int64_t lowest, int64_t newest);

// Makes a catalog on this database.  Requires: options.Validate().ok().
std::unique_ptr<Catalog> MakeSqlCatalog(std::unique_ptr<SqlBackend> backend,
                                        const CatalogOptions& options);

}  // namespace liquidblend::store
