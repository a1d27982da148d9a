// The catalog on any database that runs its transactions.
#pragma once

#include <memory>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog.h"
#include "core/store/sql/sql.h"

namespace liquidblend::store {

// A database with the catalog's tables. Errors: the body's, or as Catalog's.
// Threads: safe; of several calls each gets a connection of its own, or its turn.
class SqlBackend {
 public:
  using Body = absl::FunctionRef<absl::Status(Sql&)>;

  virtual ~SqlBackend() = default;
  // Statements that change nothing; each sees what is committed.
  virtual absl::Status Read(Body body) = 0;
  // All of the body's statements, or none; durable when it returns OK. No other Change() runs
  // meanwhile, on any machine.
  virtual absl::Status Change(Body body) = 0;
  // The same, but beside others: the body changes one job that it found with Sql::for_update.
  virtual absl::Status ChangeJob(Body body) = 0;
  // See Catalog::WaitForJob(). `until_next` is a Read() that looks for how long there is none: 0 if
  // there is one.
  using UntilNextJob = absl::FunctionRef<absl::StatusOr<absl::Duration>()>;
  virtual absl::StatusOr<bool> WaitForJob(absl::Duration timeout, UntilNextJob until_next) = 0;
};

// Requires: options.Validate().ok().
std::unique_ptr<Catalog> MakeSqlCatalog(std::unique_ptr<SqlBackend> backend,
                                        const CatalogOptions& options);

}  // namespace liquidblend::store
