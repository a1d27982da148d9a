// Families in the server's memory: loaded when first requested, replaced by a newer version once it
// is loaded, removed when memory is short.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "server/catalog/loaded_family.h"

namespace liquidblend::catalog {

// The version that a call asks for. A bare number is `exact`.
struct AskedVersion {
  AskedVersion(int64_t exact_version = 0, int64_t oldest = 0)  // NOLINT: a version is a number
      : exact(exact_version), at_least(oldest) {}
  bool Allows(int64_t version) const { return exact != 0 ? version == exact : version >= at_least; }
  int64_t exact = 0;     // 0: the latest
  int64_t at_least = 0;  // oldest acceptable one; 0: any
};

struct FamiliesOptions {
  // >= 0. Beyond it, Refresh() and calls that ask the catalog remove families that are not held,
  // the least recently used first.
  int64_t memory_budget_bytes = int64_t{8} << 30;
  // >= 0. How long a version whose load failed because of a store or of memory still counts as
  // loading.
  absl::Duration transient_failure_patience = absl::Minutes(1);
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Threads: safe; calls for one version load it once, calls for others do not wait for that.
class Families {
 public:
  using Task = absl::AnyInvocable<void()>;
  // Runs a task soon, on another thread; false: it is dropped.
  using Executor = absl::FunctionRef<bool(Task)>;
  using Done = absl::AnyInvocable<void(absl::StatusOr<FamilyPtr>)>;

  // Requires: options.Validate().ok(); both stores outlive this.
  Families(store::Catalog& catalog, store::BlobStore& blobs, const FamiliesOptions& options = {});

  // The version that is published now, once it is loaded; it stays whole for as long as the caller
  // holds it.
  // version 0: the latest. Another number: that one, which must be the latest.
  // Errors: kNotFound (no such family; another version than the one published, naming that),
  // kFailedPrecondition (nothing published yet), kDataLoss (its file is missing or damaged), and
  // those of the stores; the message names the family. A failed load is tried again by the next
  // call.
  absl::StatusOr<FamilyPtr> Get(const std::string& id, int64_t version = 0);

  // The same without waiting: while a newer version is being loaded, `done` gets the one before at
  // once, if it is in memory and `asked` allows it. Loads run on `executor`, and so may `done`,
  // else it runs before this returns. A newer version whose load failed is logged, and not tried
  // again within kRetryPause unless `asked` allows no other.
  // Errors, beside Get()'s: kNotFound if the published version is older than `asked` allows.
  void GetReady(const std::string& id, AskedVersion asked, Executor executor, Done done);
  static constexpr absl::Duration kRetryPause = absl::Seconds(5);

  // The version in memory, if `asked` allows it, without asking the catalog: it is as new as
  // Refresh() and earlier calls have made it. Null: call GetReady().
  // Cost: a look-up by name.
  FamilyPtr Peek(const std::string& id, AskedVersion asked);

  // Whether the latest version from GetReady() or Peek() would be older than `version`, now or
  // after the running load. Starts to load the newer one then. False if the family is not in
  // memory, since the catalog is asked then, and after a load that failed: at once if its file is
  // damaged, after transient_failure_patience if a store or memory was the cause.
  bool IsBehind(const std::string& id, int64_t version, Executor executor);

  // Starts to load newer versions of the families in memory, removes deleted ones, and keeps to the
  // budget. While the catalog cannot be asked they stay unchanged, which is logged once.
  // Cost: one query of the catalog, however many there are; none while nothing is in memory and no
  // family was rolled back here.
  void Refresh(Executor executor);

  // Removes a family at once, for instance after the caller has deleted it or rolled it back.
  // Versions older than min_version that running calls load are not kept in memory.
  void Forget(const std::string& id, int64_t min_version = 0);

  int64_t memory_budget_bytes() const { return options_.memory_budget_bytes; }
  int64_t size_bytes() const;                         // of all families held here
  std::map<std::string, int64_t> SizesBytes() const;  // of each, by id

 private:
  enum class Wish { kNewest, kReady, kRefresh };

  struct Waiter {
    AskedVersion asked;
    Done done;
  };

  // One version on its way into memory. Guarded by mutex_.
  struct Load {
    std::string slot;                // its key
    store::pb::FamilyRecord record;  // of a newer version if this one was replaced meanwhile
    bool is_done = false;            // then `loaded` is set, unless it failed
    FamilyPtr loaded;
    // Earliest time of a new attempt after a failure.
    base::SteadyClock::time_point retry_at = base::SteadyClock::time_point::max();
    std::vector<Waiter> waiting;
  };
  using LoadPtr = std::shared_ptr<Load>;

  // The version of a call: the published one, or one that is kept beside it.
  struct Wanted {
    std::string slot;  // its key: the family's id, or "id@version" of a kept one
    store::pb::FamilyRecord record;
  };

  struct Slot {
    LoadPtr current;  // served; or nothing yet
    LoadPtr next;     // a newer version, being loaded or failed; or nothing
    int64_t last_use = 0;
    int64_t failed_version = 0;  // of the last failed load; 0: none
    absl::Status failure;
    base::SteadyClock::time_point failed_since;  // for the first time
  };

  // Next step of a call: `ready` or `error`, or else to wait for `wait`.
  struct Choice {
    absl::Status error;
    FamilyPtr ready;
    LoadPtr wait;
    LoadPtr start;  // to be loaded by the caller
  };

  void Find(const std::string& id, AskedVersion asked, Wish wish, Executor executor, Done done);
  absl::StatusOr<store::pb::FamilyRecord> FindPublished(const std::string& id);
  absl::StatusOr<Wanted> FindWanted(const std::string& id, AskedVersion asked);
  // The record of the load's slot in the catalog now.
  absl::StatusOr<store::pb::FamilyRecord> LookAgain(const Load& load);
  void ForgetNamesake(const store::pb::FamilyRecord& record);
  FamilyPtr PeekSlot(const std::string& slot, AskedVersion asked)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Choice Choose(const Wanted& wanted, AskedVersion asked, Wish wish)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool WillCatchUp(const Slot& slot) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  static Choice ChooseCurrent(const LoadPtr& current, AskedVersion asked);
  void Run(const LoadPtr& load);
  absl::StatusOr<FamilyPtr> LoadPublished(const LoadPtr& load);
  void Finish(const LoadPtr& load, const absl::StatusOr<FamilyPtr>& result);
  // Removed families, to be destroyed without the lock, as unmapping takes a while.
  using Dropped = std::vector<FamilyPtr>;
  void Settle(const LoadPtr& load, const absl::StatusOr<FamilyPtr>& result, Dropped& dropped)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void NoteFailure(Load& load, const absl::Status& error, Slot& slot)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsOutdated(const Load& load) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DropMinVersions(const std::map<std::string, int64_t>& versions);
  void NoteRefresh(const absl::Status& status);
  bool IsEmpty() const;
  std::vector<std::string> ChangedSlots(const std::map<std::string, int64_t>& versions) const;
  void ForgetUnkeptVersions();
  void EvictIdle(Dropped& dropped) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t SizeBytes() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  const FamiliesOptions options_;
  mutable absl::Mutex mutex_;
  std::map<std::string, Slot> slots_ ABSL_GUARDED_BY(mutex_);
  // Minimum versions of families that were rolled back here. Older versions in memory are not
  // served any more.
  std::map<std::string, int64_t> min_versions_ ABSL_GUARDED_BY(mutex_);
  int64_t num_uses_ ABSL_GUARDED_BY(mutex_) = 0;
  bool is_catalog_away_ ABSL_GUARDED_BY(mutex_) = false;  // at the last Refresh()
};

}  // namespace liquidblend::catalog
