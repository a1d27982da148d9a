// The families that the server has in memory: loaded when first asked for, replaced when a newer
// version is published, let go when memory is short.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "core/mesh/registered_family.h"
#include "core/store/blob_store.h"
#include "core/store/catalog.h"
#include "server/encode/grid.h"
#include "server/finish/time_links.h"
#include "server/parameters/triangulation.h"
#include "server/slice/cell_index.h"

namespace liquidblend::catalog {

// What frames of one level of detail are made from.  Threads: safe, immutable.
struct LoadedLevel {
  explicit LoadedLevel(const mesh::RegisteredFamily& level)
      : family(level), index(level), time_links(level) {}
  const mesh::RegisteredFamily& family;  // the LoadedFamily's own, or one of its coarser levels
  const slice::CellIndex index;
  const finish::TimeLinks time_links;
};

// One version of a family with all that frames are made from.  Threads: safe, immutable.
struct LoadedFamily {
  using ParameterSpace = std::optional<const parameters::Triangulation>;
  //   triangulated  of registered.parameter_space, or nothing if that is empty
  LoadedFamily(mesh::RegisteredFamily registered, ParameterSpace triangulated);
  const mesh::RegisteredFamily family;  // name and version as in the catalog
  // By level of detail: `family`, then its coarser levels.
  const std::vector<std::unique_ptr<const LoadedLevel>> levels;
  const encode::Grid grid;  // for every frame of `family` at any level
  const ParameterSpace parameter_space;
  int64_t size_bytes = 0;  // mapped file, indices and links
};

struct FamiliesOptions {
  // >= 0. Beyond it, each Get() lets go of those that nobody holds, the least recently used first.
  int64_t memory_budget_bytes = int64_t{8} << 30;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Threads: safe; calls for one version load it once, calls for others do not wait for that.
class Families {
 public:
  // Requires: options.Validate().ok(); both stores outlive this.
  Families(store::Catalog& catalog, store::BlobStore& blobs, const FamiliesOptions& options = {});

  // The version that is published now; it stays whole for as long as the caller holds it.
  // version 0: the latest. Another number: that one, which must be the latest.
  // Errors: kNotFound (no such family; another version than the one published, naming that),
  // kFailedPrecondition (nothing published yet), kDataLoss (its file is missing or damaged), and
  // those of the stores; the message names the family. A failed load is tried again by the next
  // call.
  absl::StatusOr<std::shared_ptr<const LoadedFamily>> Get(const std::string& id,
                                                          int64_t version = 0);

  int64_t size_bytes() const;  // of all families held here

 private:
  struct Entry {
    int64_t version = 0;
    bool is_done = false;  // then `loaded` or `error` is set
    absl::Status error;
    std::shared_ptr<const LoadedFamily> loaded;
    int64_t last_use = 0;
  };
  using EntryPtr = std::shared_ptr<Entry>;

  absl::StatusOr<store::pb::FamilyRecord> FindPublished(const std::string& id, int64_t version);
  EntryPtr FindOrStartEntry(const store::pb::FamilyRecord& record, bool& is_mine);
  void LoadInto(const store::pb::FamilyRecord& record, const EntryPtr& entry);
  absl::StatusOr<std::shared_ptr<const LoadedFamily>> Load(const store::pb::FamilyRecord& record);
  void Finish(const std::string& id, const EntryPtr& entry,
              absl::StatusOr<std::shared_ptr<const LoadedFamily>> result);
  void Forget(const std::string& id);
  void EvictIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  int64_t SizeBytes() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  const FamiliesOptions options_;
  mutable absl::Mutex mutex_;
  std::map<std::string, EntryPtr> entries_ ABSL_GUARDED_BY(mutex_);
  int64_t num_uses_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace liquidblend::catalog
