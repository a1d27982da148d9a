// Metadata store and job queue: animations, families and jobs in one transactional database, so
// that accepting work and publishing results are all or nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog_upkeep.h"
#include "core/store/catalog/retry.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::store {

namespace pb = ::liquidblend::store::v1;

// Lease: a worker's exclusive right to a job. Every write about the job names the lease; it is
// refused with kAborted once the job has been leased by another worker (fencing), so a paused
// worker can do no harm.
struct Lease {
  std::string lease_id;
  pb::JobRecord job;
};

// Answer to a heartbeat: what the worker has to do.
struct JobControl {
  bool cancel_requested = false;
};

// Page of a list of records.
template <typename Record>
struct Page {
  std::vector<Record> records;      // in the order of their ids (jobs: newest first)
  std::vector<std::string> tokens;  // for each record, of the page after it
  std::string next_page_token;      // empty: no more
};

// The memory of a worker that takes any job.
inline constexpr int64_t kAnyMemory = std::numeric_limits<int64_t>::max();

// A worker that was not recorded (RecordWorker) for this long may be gone. Workers are recorded
// twice a minute while they ask for jobs, and with heartbeats.
inline constexpr absl::Duration kWorkerSilence = absl::Minutes(2);

// Check of the work's owner by calls that submit work, in their transaction. Its argument is the
// owner's use without the new work; an error refuses the work. Not called for a request that was
// accepted before. Empty: no check.
using OwnerCheck = std::function<absl::Status(const OwnerUse&)>;

// A family that frames are asked for.
struct UsedFamily {
  std::string id;
  int64_t size_bytes = 0;  // of the file of its published version
};

// Number of jobs by state.
using JobCounts = std::map<pb::JobRecord::State, int64_t>;
// Number of jobs by state and the memory that they need, in GiB, rounded up; at least 1.
using JobMemoryCounts = std::map<std::pair<pb::JobRecord::State, int64_t>, int64_t>;

// Figures of the queue for operators. Children count as jobs.
struct QueueFigures {
  int64_t num_paused = 0;     // queued jobs in the pause after a failed attempt
  int64_t num_too_large = 0;  // queued jobs that need more memory than the largest worker has
  // Since the job that was submitted first of the queued ones, without those in a pause, was
  // queued; 0 if there is none.
  absl::Duration oldest_wait;
};

// Options of a catalog, the same for both databases.
struct CatalogOptions {
  RetryOptions retry;                               // of jobs
  absl::Duration busy_timeout = absl::Seconds(10);  // >= 0; how long to wait for other processes
  int max_connections = 8;                          // >= 1; PostgreSQL: so many calls at once
  // The clock of times and leases; empty: the system's with SQLite, the database's with PostgreSQL.
  std::function<absl::Time()> now;
  absl::Status Validate() const;  // names the first field out of range
};

// The share of the children in the work of a registration. A registration of several targets is
// WAITING while its children, one job per target in their order, are worked on; the end of the last
// child makes it QUEUED, for a worker to put the results together. Children are not listed or found
// by their ids. They exist until the registration ends in any way; then workers of remaining
// children have lost their leases.
inline constexpr double kChildrenShare = 0.9;

// The longest lease: longer ones are cut to it, a lease that ends later than this from now counts
// as expired, and pauses between attempts are shorter. So a clock that is turned back, by any span,
// keeps the job of a lost worker from others for this long at most.
inline constexpr absl::Duration kLongestLease = absl::Minutes(10);

// Metadata store and job queue in one database. Records name animations, families and jobs by their
// bare ids.
// Threads: safe; processes: safe, but a catalog must not be used on both sides of a fork(). All
// calls are durable when they return OK.
// Errors of all calls: kUnavailable (locked or lost database), kResourceExhausted (disk full),
// kPermissionDenied, kDataLoss (corrupt database); messages name the database. kInvalidArgument for
// a record that contradicts itself, a string that is not UTF-8, or a page token of another list.
// Page sizes: at most 1000; 0 or less: 100. A page ends earlier if its records have 4 MiB: it has
// at least one, and a next_page_token if more follow.
class Catalog : public CatalogUpkeep {
 public:
  // ---- Accepting work: the row and its job appear together.

  // Submits an import: writes the animation's row and its job. Fills job.id and times. A non-empty
  // job.request_id seen before returns that job unchanged (kInvalidArgument if it belongs to other
  // work). Errors: kAlreadyExists if the animation's id is taken (a FAILED one is replaced).
  virtual absl::StatusOr<pb::JobRecord> SubmitImport(const pb::AnimationRecord& animation,
                                                     pb::JobRecord job,
                                                     const OwnerCheck& check = {}) = 0;
  // Submits a registration, and creates the family's row if it is new. Errors: kNotFound or
  // kFailedPrecondition if an animation is missing or not READY, naming it; kFailedPrecondition if
  // a registration of the family is not done; kAlreadyExists if the job wants a new family and the
  // family has a version.
  virtual absl::StatusOr<pb::JobRecord> SubmitRegistration(pb::JobRecord job,
                                                           const OwnerCheck& check = {}) = 0;
  // The result of `check` if the job were submitted now, so that clients can learn early of a
  // refusal.
  virtual absl::Status CheckOwner(const pb::JobRecord& job, const OwnerCheck& check) = 0;

  // ---- Reading.

  // The following return one record, or a page of all.  Errors: kNotFound if there is no such
  // record.
  virtual absl::StatusOr<pb::AnimationRecord> GetAnimation(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::AnimationRecord>> ListAnimations(int page_size,
                                                                   const std::string& token) = 0;
  virtual absl::StatusOr<pb::FamilyRecord> GetFamily(const std::string& id) = 0;
  // The published version, or one that is kept beside it. Errors: kNotFound, naming the versions
  // that exist.
  virtual absl::StatusOr<pb::FamilyRecord> GetFamilyVersion(const std::string& id,
                                                            int64_t version) = 0;
  // The versions that are kept beside the published one, newest first; none if there is no such
  // family.
  virtual absl::StatusOr<std::vector<pb::FamilyRecord>> ListKeptVersions(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::FamilyRecord>> ListFamilies(int page_size,
                                                              const std::string& token) = 0;
  virtual absl::StatusOr<pb::JobRecord> GetJob(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::JobRecord>> ListJobs(int page_size, const std::string& token) = 0;
  // The children of a job in the order of the targets; none if the job is done, has none, or does
  // not exist.
  virtual absl::StatusOr<std::vector<pb::JobRecord>> ListChildren(const std::string& job_id) = 0;
  // The number of jobs and children of jobs per state; states without any are left out.
  virtual absl::StatusOr<JobCounts> CountJobs() = 0;
  // The number of queued and running jobs and children by the memory that they need.
  virtual absl::StatusOr<JobMemoryCounts> CountJobsByMemory() = 0;
  // Measures the queue.  Cost: reads the rows of all queued jobs, and one record.
  //   memory_bytes  of the largest worker
  virtual absl::StatusOr<QueueFigures> MeasureQueue(int64_t memory_bytes) = 0;
  // The jobs that ended after that time, the newest first, at most max_jobs. No children, and
  // without the lists of their requests: files, times of frames, correspondences.
  virtual absl::StatusOr<std::vector<pb::JobRecord>> ListEndedJobs(absl::Time after,
                                                                   int max_jobs) = 0;
  // Every blob that a record, an unfinished job or a child of one refers to, sorted, each once.
  // Changes may be committed meanwhile. No blob is missing that is referred to during the whole
  // call by one animation or child, by one family or its kept versions, or by jobs one after the
  // other. If another record takes it over, it may be missing; but then it was committed again, and
  // is young (docs/formats.md, "Collecting garbage").
  virtual absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() = 0;

  // ---- Use.

  // Adds to the numbers of frames that were asked for, by family; names without a family are left
  // out.
  virtual absl::Status RecordFamilyUses(const std::map<std::string, int64_t>& num_frames) = 0;
  // The families with a published version that were asked for within a week, the most asked for
  // first: a frame of n days ago counts as 1 / (n + 1).
  virtual absl::StatusOr<std::vector<UsedFamily>> ListMostUsedFamilies(int max_num) = 0;

  // ---- Going back.

  // Publishes a kept version again, with the next number; does nothing if the published one is that
  // version again already. Keeps `keep_versions` versions, the new one included. Errors: kNotFound;
  // kFailedPrecondition if that version is the published one, or while a registration of the family
  // is not done.
  virtual absl::StatusOr<pb::FamilyRecord> RollbackFamily(const std::string& id, int64_t version,
                                                          int keep_versions) = 0;

  // ---- Removing.

  // Deletes an animation. Errors: kNotFound; kFailedPrecondition if a family or an unfinished job
  // needs it, naming it.
  virtual absl::Status DeleteAnimation(const std::string& id) = 0;
  // Deletes a family with all versions. Errors: kNotFound; kFailedPrecondition while a registration
  // of it is not done.
  virtual absl::Status DeleteFamily(const std::string& id) = 0;
  // Deletes a job from the history. Errors: kNotFound; kFailedPrecondition unless the job is done.
  virtual absl::Status DeleteJob(const std::string& id) = 0;

  // ---- The queue.

  // Leases a job or child that is queued and whose pause is over, or whose lease has expired;
  // nothing if there is none. The order: the highest priority first; owners take turns; an owner's
  // oldest first. A job whose attempts are used up fails here instead of being leased again; a job
  // that has lost its worker pauses first. An attempt that lost its worker after a new checkpoint
  // uses up none.
  //   memory_bytes  the worker's memory: jobs that need more are left to others
  virtual absl::StatusOr<std::optional<Lease>> LeaseJob(const std::string& worker,
                                                        absl::Duration duration,
                                                        int64_t memory_bytes = kAnyMemory) = 0;
  // Waits until there may be a job to take, at most `timeout`. Returns whether there may be one.
  virtual absl::StatusOr<bool> WaitForJob(absl::Duration timeout,
                                          int64_t memory_bytes = kAnyMemory) = 0;
  // Records that the worker is there, and whether it takes jobs (WorkerRecord::refusal). Cheap if
  // that was recorded a moment ago. LeaseJob() does so, too, for a worker that takes jobs.
  // seen_time is filled here.
  virtual absl::Status RecordWorker(const pb::WorkerRecord& worker) = 0;
  // The workers that were recorded within kWorkerSilence, by name.
  virtual absl::StatusOr<std::vector<pb::WorkerRecord>> ListWorkers() = 0;
  // Renews the lease, records progress, and returns whether the job is to be cancelled.
  virtual absl::StatusOr<JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                               const pb::JobProgress& progress) = 0;
  // Records a checkpoint file in place of the one before. The next worker of the job finds it in
  // the record. It is referenced (ListReferencedBlobs) until another replaces it or the job ends.
  virtual absl::Status SaveCheckpoint(const std::string& lease_id, const std::string& blob) = 0;
  // Finishes an import and publishes its animation, whose state becomes READY, in one transaction.
  virtual absl::Status PublishAnimation(const std::string& lease_id,
                                        const pb::AnimationRecord& animation) = 0;
  // Finishes a registration and publishes its family, in one transaction. Returns the version,
  // which is assigned here: the last one + 1, also counting those of a deleted family of that id,
  // so that no number is given twice. The version before is kept, as far as
  // RegisterJob::keep_versions allows.
  virtual absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                                const pb::FamilyRecord& family) = 0;
  // Finishes a child with the target file that it made. Errors: kInvalidArgument if the job is not
  // a child.
  virtual absl::Status FinishChild(const std::string& lease_id, const std::string& blob) = 0;
  // Gives a registration back whose children are to be done again, as their results cannot be used:
  // these return to the queue, and it waits for them. Uses up no attempt of any. `why` becomes a
  // failed attempt of each of them and, with the target's name, of the registration, which is
  // cancelled instead if that was requested. Errors: kInvalidArgument if an id is not that of a
  // child of this job that has succeeded.
  virtual absl::Status RepeatChildren(const std::string& lease_id,
                                      const std::vector<std::string>& children,
                                      const absl::Status& why) = 0;
  // Ends an attempt with an error. With `retry` the job returns to the queue while attempts are
  // left, and pauses as CatalogOptions::retry requires. Otherwise it is FAILED (CANCELLED if the
  // error is kCancelled or a cancellation was requested), with the error kept in the job and, for
  // an import, in the animation. A transient error (core/base/retry.h) uses up no attempt, but
  // there is a limit to these, too. A child that fails for good fails its registration, whose error
  // then names the target.
  virtual absl::Status FailJob(const std::string& lease_id, const absl::Status& error,
                               bool retry) = 0;
  // Gives a job back (the worker is stopping). The attempt does not count; JobRecord::handed_back
  // does.
  virtual absl::Status ReleaseJob(const std::string& lease_id) = 0;
  // Cancels a job: a queued or waiting one at once, a running one when its worker learns of it at
  // the next heartbeat (or is lost). OK if done. Errors: kNotFound.
  virtual absl::Status RequestCancel(const std::string& job_id) = 0;
};

// Opens a catalog in a SQLite file, in WAL mode with synchronous=FULL. Creates the file and its
// tables if missing, and brings older ones up to date. Errors, beside the above:
// kFailedPrecondition if the file is not a catalog, or was made by a newer program.
absl::StatusOr<std::unique_ptr<Catalog>> OpenSqliteCatalog(const std::string& path,
                                                           const CatalogOptions& options = {});

// Opens a catalog in PostgreSQL 15 or newer. `url` has libpq's form:
// postgresql://user@host:port/database?...; missing settings are taken from PGPASSWORD, PGPASSFILE
// and so on. The tables are in the first schema of the search path, which must hold nothing else;
// they are made if missing, and brought up to date.
// A call whose connection is lost fails with kUnavailable, unless it had not begun; later calls
// connect again. After a loss during a COMMIT its outcome is not known. busy_timeout: also how long
// one statement may take. Errors, beside the above: kInvalidArgument for an invalid url;
// kFailedPrecondition if the schema holds something else, or the catalog of a newer program. No
// message has the password.
absl::StatusOr<std::unique_ptr<Catalog>> OpenPostgresCatalog(const std::string& url,
                                                             const CatalogOptions& options = {});

// The versions of the tables of SQLite and PostgreSQL that this program writes (docs/formats.md,
// "The catalog").
int64_t SqliteTablesVersion();
int64_t PostgresTablesVersion();

}  // namespace liquidblend::store
