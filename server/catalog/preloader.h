// Preloader: loads the families that are asked for most when a server starts, before it is ready.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/catalog.h"
#include "server/catalog/families.h"

namespace liquidblend::catalog {

// Loads families in the order of their use (Catalog::ListMostUsedFamilies), as many as fit the
// memory for families. One that cannot be loaded is logged and left out. Must be owned by a
// shared_ptr.  Threads: safe.
class Preloader : public std::enable_shared_from_this<Preloader> {
 public:
  using Task = Families::Task;
  // Runs a task soon, on another thread; false: it is dropped.
  using Post = std::function<bool(Task)>;

  // Both outlive the posted tasks.
  Preloader(store::Catalog& catalog, Families& families) : catalog_(catalog), families_(families) {}

  // Starts to load, if the catalog has something to load. To be called once.
  //   ask       for questions to the catalog
  //   load      for loads; kNumAtOnce families are loaded at a time
  //   when_over called once: when all are loaded, or at Stop()
  void Start(Post ask, Post load, Task when_over);
  static constexpr int kNumAtOnce = 2;

  // Begins no more loads: the time for it is over. Those under way go on.
  void Stop();

  // OK unless it is loading. Errors: kUnavailable: "preloading families: 3 of 8 are there".
  absl::Status CheckIsOver() const;

 private:
  void List();
  void FillUp();
  std::optional<store::UsedFamily> TakeNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Load(const store::UsedFamily& family);
  void OnLoaded(const store::UsedFamily& family, const absl::StatusOr<FamilyPtr>& loaded);
  void End(absl::string_view why);

  store::Catalog& catalog_;
  Families& families_;
  Post ask_, load_;
  base::SteadyClock::time_point start_;
  mutable absl::Mutex mutex_;
  Task when_over_ ABSL_GUARDED_BY(mutex_);  // null: not started, or over
  std::deque<store::UsedFamily> waiting_ ABSL_GUARDED_BY(mutex_);
  int num_families_ ABSL_GUARDED_BY(mutex_) = 0;  // in all, without those that do not fit
  int num_loaded_ ABSL_GUARDED_BY(mutex_) = 0;
  int num_running_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t running_bytes_ ABSL_GUARDED_BY(mutex_) = 0;  // of the files of running loads
  // Memory of a family, with its indices, by its file: a guess, or the most that was seen.
  double memory_per_byte_ ABSL_GUARDED_BY(mutex_) = 2.0;
};

}  // namespace liquidblend::catalog
