// What there is (animations, families) and what there is to do (the job queue), in one
// transactional place, so that accepting work and publishing results are all or nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "core/store/catalog/catalog_upkeep.h"
#include "core/store/catalog/retry.h"
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

// What a worker can hold that takes any job.
inline constexpr int64_t kAnyMemory = std::numeric_limits<int64_t>::max();

// A worker that has not told of itself for so long may be gone. It does so twice a minute while it
// asks for jobs, and with heartbeats.
inline constexpr absl::Duration kWorkerSilence = absl::Minutes(2);

// Asked by calls that submit work, in their transaction, what the work's owner has without it; an
// error refuses the work. Not asked about a request that was accepted before. Empty: all may.
using OwnerCheck = std::function<absl::Status(const OwnerUse&)>;

using JobCounts = std::map<pb::JobRecord::State, int64_t>;

struct CatalogOptions {
  RetryOptions retry;                               // of jobs
  absl::Duration busy_timeout = absl::Seconds(10);  // >= 0; how long to wait for other processes
  int max_connections = 8;                          // >= 1; PostgreSQL: so many calls at once
  // The clock of times and leases; empty: the system's with SQLite, the database's with PostgreSQL.
  std::function<absl::Time()> now;
  absl::Status Validate() const;  // names the first field out of range
};

// A registration of several targets is WAITING while its parts, one job per target in their order,
// are worked on; the end of the last part makes it QUEUED, for someone to put the results together.
// Its parts are not listed or known by their ids, and exist until it ends, however it does: then
// whoever still works on one has lost the lease. This is the share of the parts in the whole work.
inline constexpr double kPartsShare = 0.9;

// A longer lease than this counts as one of this length, and no pause before another attempt is as
// long. So a clock that is turned back (by less, or by however much) keeps the job of a lost worker
// from others for this long at most.
inline constexpr absl::Duration kLongestLease = absl::Minutes(10);

// Records name animations, families and jobs by their bare ids.
// Threads: safe; processes: safe, but a catalog must not be used on both sides of a fork().
// All calls are durable when they return OK.
// Errors of all calls: kUnavailable (locked or lost database), kResourceExhausted (disk full),
// kPermissionDenied, kDataLoss (corrupt database); messages name the database. kInvalidArgument for
// a record that contradicts itself, a string that is not UTF-8, or a page token not from here.
// Page sizes: at most 1000; 0 or less: 100.
class Catalog : public CatalogUpkeep {
 public:
  // ---- accepting work: the row and its job appear together
  // Fills job.id and times. A non-empty job.request_id seen before returns that job unchanged
  // (kInvalidArgument if it belongs to other work).
  // Errors: kAlreadyExists if the animation's id is taken (a FAILED one is replaced).
  virtual absl::StatusOr<pb::JobRecord> SubmitImport(const pb::AnimationRecord& animation,
                                                     pb::JobRecord job,
                                                     const OwnerCheck& check = {}) = 0;
  // Creates the family's row if it is new. Errors: kNotFound or kFailedPrecondition if an animation
  // is missing or not READY, naming it; kFailedPrecondition if a registration of the family is not
  // done; kAlreadyExists if the job wants a new family and the family has a version.
  virtual absl::StatusOr<pb::JobRecord> SubmitRegistration(pb::JobRecord job,
                                                           const OwnerCheck& check = {}) = 0;
  // What `check` would say now, were the job submitted: to spare its owner work in vain.
  virtual absl::Status CheckOwner(const pb::JobRecord& job, const OwnerCheck& check) = 0;

  // ---- reading
  virtual absl::StatusOr<pb::AnimationRecord> GetAnimation(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::AnimationRecord>> ListAnimations(int page_size,
                                                                   const std::string& token) = 0;
  virtual absl::StatusOr<pb::FamilyRecord> GetFamily(const std::string& id) = 0;
  // The published version, or one that is kept beside it. Errors: kNotFound, naming those there
  // are.
  virtual absl::StatusOr<pb::FamilyRecord> GetFamilyVersion(const std::string& id,
                                                            int64_t version) = 0;
  // Those that are kept beside the published one, newest first; none if there is no such family.
  virtual absl::StatusOr<std::vector<pb::FamilyRecord>> ListKeptVersions(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::FamilyRecord>> ListFamilies(int page_size,
                                                              const std::string& token) = 0;
  virtual absl::StatusOr<pb::JobRecord> GetJob(const std::string& id) = 0;
  virtual absl::StatusOr<Page<pb::JobRecord>> ListJobs(int page_size, const std::string& token) = 0;
  // In the order of the targets; none if the job is done, has none, or does not exist.
  virtual absl::StatusOr<std::vector<pb::JobRecord>> ListParts(const std::string& job_id) = 0;
  // How many jobs and parts of jobs are in which state; states that none is in are left out.
  virtual absl::StatusOr<JobCounts> CountJobs() = 0;
  // Every blob that a record, an unfinished job or a part of one refers to, sorted, each once.
  virtual absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() = 0;

  // ---- going back
  // Publishes a kept version again, with the next number; nothing if the published one is that
  // version again already. Keeps as many versions as that, the new one counted. Errors: kNotFound;
  // kFailedPrecondition if that version is the published one, or while a registration of the family
  // is not done.
  virtual absl::StatusOr<pb::FamilyRecord> RollbackFamily(const std::string& id, int64_t version,
                                                          int keep_versions) = 0;

  // ---- removing
  // Errors: kNotFound; kFailedPrecondition if a family or an unfinished job needs it, naming it.
  virtual absl::Status DeleteAnimation(const std::string& id) = 0;
  // With all versions. Errors: kNotFound; kFailedPrecondition while a registration of it is not
  // done.
  virtual absl::Status DeleteFamily(const std::string& id) = 0;
  // Errors: kNotFound; kFailedPrecondition unless the job is done.
  virtual absl::Status DeleteJob(const std::string& id) = 0;

  // ---- the queue
  // Takes a job or part that is queued and not to be left alone for a while, or whose lease has
  // expired; nothing if there is none. Of several, one of the highest priority; of these, owners
  // take turns; of an owner's the oldest. One whose attempts are used up fails here instead
  // of being given out again; one that has lost its worker before is left alone first.
  //   memory_bytes  what the worker can hold: jobs that need more are left to others
  virtual absl::StatusOr<std::optional<Lease>> LeaseJob(const std::string& worker,
                                                        absl::Duration duration,
                                                        int64_t memory_bytes = kAnyMemory) = 0;
  // Waits until there may be a job to take, but not longer than this. Returns whether there may be.
  virtual absl::StatusOr<bool> WaitForJob(absl::Duration timeout,
                                          int64_t memory_bytes = kAnyMemory) = 0;
  // Records that the worker is there, and whether it takes jobs (WorkerRecord::refusal). Cheap if
  // that was recorded a moment ago. LeaseJob() does so, too: whoever asks for a job takes jobs.
  // seen_time is filled here.
  virtual absl::Status RecordWorker(const pb::WorkerRecord& worker) = 0;
  // Those that have told of themselves within kWorkerSilence, by name.
  virtual absl::StatusOr<std::vector<pb::WorkerRecord>> ListWorkers() = 0;
  // Renews the lease, records progress, tells whether someone asked to cancel.
  virtual absl::StatusOr<JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                               const pb::JobProgress& progress) = 0;
  // A checkpoint file to go on from, in place of the one before: whoever takes the job next finds
  // it in the record, and it is needed (ListReferencedBlobs) until another replaces it or the job
  // ends.
  virtual absl::Status SaveCheckpoint(const std::string& lease_id, const std::string& blob) = 0;
  // Finish the job and show its result, together. The import: state becomes READY.
  virtual absl::Status PublishAnimation(const std::string& lease_id,
                                        const pb::AnimationRecord& animation) = 0;
  // family.version is assigned here and returned: the last one + 1, also counting those of a
  // deleted family of that id, so that a version never means two things. The one before is kept,
  // as far as RegisterJob::keep_versions says.
  virtual absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                                const pb::FamilyRecord& family) = 0;
  // Finishes a part with the target file that it made. Errors: kInvalidArgument if it is no part.
  virtual absl::Status FinishPart(const std::string& lease_id, const std::string& blob) = 0;
  // retry: back to the queue while attempts are left, and not to be given out for the pause that
  // CatalogOptions::retry says; else FAILED (kCancelled, or someone asked to cancel: CANCELLED),
  // with the error kept in the job and, for an import, in the animation. A failure of the
  // environment (retry.h) uses up no attempt, but there is a limit to these, too. A part that fails
  // for good fails its registration, whose error then names the target.
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

// PostgreSQL 15 or newer. `url` is what libpq takes: postgresql://user@host:port/database?...; what
// it does not say is taken from PGPASSWORD, PGPASSFILE and so on. The tables are in the first
// schema of the search path, which is for them alone; they are made if missing, and brought up to
// date. A call that meets a lost connection fails with kUnavailable unless it could not have begun;
// later calls connect anew. Where a COMMIT was under way, what became of it is not known.
// busy_timeout: also how long one statement may take. Errors, beside the above: kInvalidArgument
// for a url that is none; kFailedPrecondition if the schema holds something else, or the catalog of
// a newer program. No message has the password.
absl::StatusOr<std::unique_ptr<Catalog>> OpenPostgresCatalog(const std::string& url,
                                                             const CatalogOptions& options = {});

// The version of each one's tables that this program writes (docs/formats.md, "The catalog").
int64_t SqliteTablesVersion();
int64_t PostgresTablesVersion();

}  // namespace liquidblend::store
