// What there is (animations, families) and what there is to do (the job queue), in one
// transactional place, so that accepting work and publishing results are all or nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::store {

namespace pb = ::liquidblend::store::v1;

// A worker's hold on a job. Every write about the job names the lease; it is refused with kAborted
// once the lease has been given to someone else (fencing), so a paused worker can do no harm.
struct Lease {
  std::string lease_id;
  pb::JobRecord job;
};

struct JobControl {
  bool cancel_requested = false;
};

template <typename Record>
struct Page {
  std::vector<Record> records;  // in the order of their ids (jobs: newest first)
  std::string next_page_token;  // empty: no more
};

struct CatalogOptions {
  int max_attempts = 3;  // >= 1; a job whose worker was lost this often fails for good
  absl::Duration busy_timeout = absl::Seconds(10);  // >= 0; how long to wait for other processes
  std::function<absl::Time()> now;  // the clock of times and leases; empty: absl::Now
  absl::Status Validate() const;    // names the first field out of range
};

// A registration of several targets is WAITING while its parts, one job per target in their order,
// are worked on; the end of the last part makes it QUEUED, for someone to put the results together.
// Its parts are not listed or known by their ids, and exist until it ends, however it does: then
// whoever still works on one has lost the lease. This is the share of the parts in the whole work.
inline constexpr double kPartsShare = 0.9;

// Records name animations, families and jobs by their bare ids.
// Threads: safe; processes: safe, but a catalog must not be used on both sides of a fork().
// All calls are durable when they return OK.
// Errors of all calls: kUnavailable (locked or lost database), kResourceExhausted (disk full),
// kPermissionDenied, kDataLoss (corrupt database); messages name the database. kInvalidArgument for
// a record that contradicts itself, a string that is not UTF-8, or a page token not from here.
// Page sizes: at most 1000; 0 or less: 100.
class Catalog {
 public:
  virtual ~Catalog() = default;

  // ---- accepting work: the row and its job appear together
  // Fills job.id and times. A non-empty job.request_id seen before returns that job unchanged
  // (kInvalidArgument if it belongs to other work).
  // Errors: kAlreadyExists if the animation's id is taken (a FAILED one is replaced).
  virtual absl::StatusOr<pb::JobRecord> SubmitImport(const pb::AnimationRecord& animation,
                                                     pb::JobRecord job) = 0;
  // Creates the family's row if it is new. Errors: kNotFound or kFailedPrecondition if an animation
  // is missing or not READY, naming it; kFailedPrecondition if a registration of the family is not
  // done.
  virtual absl::StatusOr<pb::JobRecord> SubmitRegistration(pb::JobRecord job) = 0;

  // ---- reading
  virtual absl::StatusOr<pb::AnimationRecord> GetAnimation(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::AnimationRecord>> ListAnimations(int page_size,
                                                                   const std::string& token) = 0;
  virtual absl::StatusOr<pb::FamilyRecord> GetFamily(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::FamilyRecord>> ListFamilies(int page_size,
                                                              const std::string& token) = 0;
  virtual absl::StatusOr<pb::JobRecord> GetJob(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::JobRecord>> ListJobs(int page_size, const std::string& token) = 0;
  // In the order of the targets; none if the job is done, has none, or does not exist.
  virtual absl::StatusOr<std::vector<pb::JobRecord>> ListParts(const std::string& job_id) = 0;
  // Every blob that a record, an unfinished job or a part of one refers to, sorted, each once.
  virtual absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() = 0;

  // ---- removing
  // Errors: kNotFound; kFailedPrecondition if a family or an unfinished job needs it, naming it.
  virtual absl::Status DeleteAnimation(const std::string& id) = 0;
  // Errors: kNotFound; kFailedPrecondition while a registration of it is not done.
  virtual absl::Status DeleteFamily(const std::string& id) = 0;
  // Errors: kNotFound; kFailedPrecondition unless the job is done.
  virtual absl::Status DeleteJob(const std::string& id) = 0;

  // ---- the queue
  // Takes the oldest job or part that is queued, or whose lease has expired; nothing if there is
  // none. One whose attempts are used up fails here instead of being given out again.
  virtual absl::StatusOr<std::optional<Lease>> LeaseJob(const std::string& worker,
                                                        absl::Duration duration) = 0;
  // Renews the lease, records progress, tells whether someone asked to cancel.
  virtual absl::StatusOr<JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                               const pb::JobProgress& progress) = 0;
  // Finish the job and show its result, together. The import: state becomes READY.
  virtual absl::Status PublishAnimation(const std::string& lease_id,
                                        const pb::AnimationRecord& animation) = 0;
  // family.version is assigned here and returned: the last one + 1, also counting those of a
  // deleted family of that id, so that a version never means two things.
  virtual absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                                const pb::FamilyRecord& family) = 0;
  // Finishes a part with the target file that it made. Errors: kInvalidArgument if it is no part.
  virtual absl::Status FinishPart(const std::string& lease_id, const std::string& blob) = 0;
  // retry: back to the queue while attempts are left; else FAILED (kCancelled, or someone asked to
  // cancel: CANCELLED), with the error kept in the job and, for an import, in the animation. A part
  // that fails for good fails its registration, whose error then names the target.
  virtual absl::Status FailJob(const std::string& lease_id, const absl::Status& error,
                               bool retry) = 0;
  // Gives a job back untouched (the worker is stopping); the attempt does not count.
  virtual absl::Status ReleaseJob(const std::string& lease_id) = 0;
  // A queued or waiting job is CANCELLED at once, a running one when its worker hears of it (or is
  // lost). OK if done. Errors: kNotFound.
  virtual absl::Status RequestCancel(const std::string& job_id) = 0;
};

// SQLite in WAL mode with synchronous=FULL; creates the file and its tables if missing, and brings
// older ones up to date. Errors, beside the above: kFailedPrecondition if the file is no catalog,
// or was made by a newer program.
absl::StatusOr<std::unique_ptr<Catalog>> OpenSqliteCatalog(const std::string& path,
                                                           const CatalogOptions& options = {});

}  // namespace liquidblend::store
