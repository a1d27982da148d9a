// Checkpoints of a running registration, from which another worker can resume it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/base/steady_cond_var.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "worker/registration/fit/state.h"

namespace liquidblend::jobs {

struct CheckpointOptions {
  int iterations = 2;  // >= 0; at least so many between two checkpoints; 0: none are made
  absl::Duration interval = absl::Seconds(10);  // >= 0; at least so long between two of them
  // >= 0; how long a stopping worker waits for the last checkpoint.
  absl::Duration patience = absl::Seconds(1);
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// The checkpoints of one job. They are written by a separate thread, so that slow storage does not
// delay the work; a failure is logged, and the work goes on. Each replaces the one before, whose
// blob is then deleted. This is safe, as no two checkpoints have the same bytes. Blobs that a
// killed worker leaves are unreferenced, and are collected as garbage.
// Threads: Begin() and End() from the job's, the others from any.
class Checkpoints {
 public:
  // Requires: options.Validate().ok(); catalog and blobs outlive this.
  Checkpoints(store::Catalog& catalog, store::BlobStore& blobs, const store::Lease& lease,
              const CheckpointOptions& options);
  ~Checkpoints();
  Checkpoints(const Checkpoints&) = delete;
  Checkpoints& operator=(const Checkpoints&) = delete;

  // Begins the registration of this fingerprint. Returns the checkpoint of an earlier attempt;
  // nothing if there is none, or (logged) if it is gone, damaged or of another fingerprint. To be
  // called at most once. Errors: transient ones of the store, as the checkpoint may still be good.
  absl::StatusOr<std::optional<registration::RegistrationState>> Begin(std::string fingerprint);

  // Offers the newest state. Cost: does not wait.
  void Offer(registration::RegistrationState state);

  // Saves the newest state now, regardless of the interval options; waits at most options.patience.
  void Flush();

  // Whether this attempt has saved one.
  bool HasNew() const;

  // What this attempt has saved, and which work another one will do again, for the log: "with a
  // checkpoint after iteration 6; lost is the work of 1.2s since then".
  std::string DescribeSaved() const;

  // Ends the checkpoints. Waits for one that is being written; then deletes the last one, if the
  // job is done.
  void End(bool is_done);

 private:
  using State = registration::RegistrationState;

  absl::StatusOr<State> Load(const std::string& fingerprint);
  void Run();
  // Waits for a state that is due; null at the end.
  std::shared_ptr<const State> AwaitNext();
  void Save(const State& state);
  absl::StatusOr<store::BlobId> Write(const State& state);
  void DeleteEarlier();
  void LogTrouble(const std::string& what, const absl::Status& status) const;

  bool IsDue() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsUrgent() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsDueOrUrgent() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return IsDue() || IsUrgent(); }
  bool IsFlushed() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  store::Catalog& catalog_;
  store::BlobStore& blobs_;
  const std::string job_id_, lease_id_;
  const std::string first_;  // the job's checkpoint from an earlier attempt, or empty
  const CheckpointOptions options_;
  std::string fingerprint_;             // set before the thread starts
  int64_t num_written_ = 0;             // of the thread
  std::vector<store::BlobId> earlier_;  // of the thread: the record names the last one at most

  mutable absl::Mutex mutex_;
  base::SteadyCondVar urgent_, flushed_;  // signalled when IsUrgent() or IsFlushed() may change
  std::shared_ptr<const State> newest_ ABSL_GUARDED_BY(mutex_);
  base::SteadyClock::time_point newest_at_ ABSL_GUARDED_BY(mutex_);  // when it was offered
  base::SteadyClock::time_point taken_at_ ABSL_GUARDED_BY(mutex_);   // likewise, of the one taken
  // Of the last one that the catalog has: "iteration 6", and when it was offered. Of none: empty,
  // and the begin of the attempt.
  std::string saved_ ABSL_GUARDED_BY(mutex_);
  base::SteadyClock::time_point saved_at_ ABSL_GUARDED_BY(mutex_);
  // Numbers of states: offered, taken for saving, finished (saved or not), and to be flushed.
  int64_t num_offered_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_taken_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_done_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_flushed_ ABSL_GUARDED_BY(mutex_) = 0;
  bool is_running_ ABSL_GUARDED_BY(mutex_) = false;  // the thread runs
  bool is_ended_ ABSL_GUARDED_BY(mutex_) = false;    // or the lease is lost
  std::thread thread_;                               // used by Begin() and End() only
};

}  // namespace liquidblend::jobs
