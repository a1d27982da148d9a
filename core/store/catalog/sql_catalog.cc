#include "core/store/catalog/sql_catalog.h"

#include <algorithm>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "core/base/fault_point.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/store/catalog/blob_tables.h"
#include "core/store/catalog/catalog_tables.h"
#include "core/store/catalog/figure_tables.h"
#include "core/store/catalog/inspection.h"
#include "core/store/catalog/job_queue.h"
#include "core/store/catalog/job_records.h"
#include "core/store/catalog/next_job.h"
#include "core/store/catalog/outage_watch.h"
#include "core/store/catalog/owner_tables.h"
#include "core/store/catalog/upkeep_tables.h"
#include "core/store/catalog/use_tables.h"
#include "core/store/catalog/version_tables.h"
#include "core/store/catalog/worker_tables.h"

namespace liquidblend::store {
namespace {

constexpr int64_t kPrunedAtOnce = 500;  // so that others get their turns

// Result types of the bodies of Read() and Change().
template <typename Body>
using ReadResult = std::invoke_result_t<Body, Sql&>;
template <typename Body>
using ChangeResult = std::invoke_result_t<Body, Sql&, absl::Time>;

absl::Status StatusOf(const absl::Status& result) { return result; }
template <typename T>
absl::Status StatusOf(const absl::StatusOr<T>& result) {
  return result.status();
}

absl::Status NeededByError(const std::string& subject, const std::string& job) {
  return absl::FailedPreconditionError(
      absl::StrCat(subject, " is needed by job '", job, "', which is not done"));
}

absl::Status CheckDone(Sql& sql, const std::string& subject) {
  LB_ASSIGN_OR_RETURN(const std::string job, FindUnfinishedJobOf(sql, subject));
  return job.empty() ? absl::OkStatus() : NeededByError(subject, job);
}

absl::Status CheckUnneeded(Sql& sql, const std::string& animation) {
  LB_ASSIGN_OR_RETURN(const std::string family, FindFamilyWith(sql, animation));
  const std::string subject = absl::StrCat("animation '", animation, "'");
  if (!family.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(subject, " is part of family '", family, "'"));
  }
  LB_ASSIGN_OR_RETURN(const std::string import,
                      FindUnfinishedJobOf(sql, absl::StrCat("animations/", animation)));
  if (!import.empty()) return NeededByError(subject, import);
  LB_ASSIGN_OR_RETURN(const std::string registration,
                      FindUnfinishedRegistrationWith(sql, animation));
  return registration.empty() ? absl::OkStatus() : NeededByError(subject, registration);
}

class SqlCatalog : public Catalog {
 public:
  SqlCatalog(std::unique_ptr<SqlBackend> backend, const CatalogOptions& options)
      : options_(options), backend_(std::move(backend)) {}

  absl::StatusOr<pb::JobRecord> SubmitImport(const pb::AnimationRecord& animation,
                                             pb::JobRecord job, const OwnerCheck& check) override {
    return Change([&](Sql& sql, absl::Time now) {
      return store::SubmitImport(sql, animation, job, check, now);
    });
  }
  absl::StatusOr<pb::JobRecord> SubmitRegistration(pb::JobRecord job,
                                                   const OwnerCheck& check) override {
    return Change(
        [&](Sql& sql, absl::Time now) { return store::SubmitRegistration(sql, job, check, now); });
  }
  absl::Status CheckOwner(const pb::JobRecord& job, const OwnerCheck& check) override {
    return Read([&](Sql& sql) { return store::CheckOwner(sql, job, check); });
  }

  absl::StatusOr<pb::AnimationRecord> GetAnimation(const std::string& id) override {
    return Read([&](Sql& sql) { return FindAnimation(sql, id); });
  }
  absl::StatusOr<Page<pb::AnimationRecord>> ListAnimations(int page_size,
                                                           const std::string& token) override {
    return Read([&](Sql& sql) { return PageOfAnimations(sql, page_size, token); });
  }
  absl::StatusOr<pb::FamilyRecord> GetFamily(const std::string& id) override {
    return Read([&](Sql& sql) { return FindFamily(sql, id); });
  }
  absl::StatusOr<pb::FamilyRecord> GetFamilyVersion(const std::string& id,
                                                    int64_t version) override {
    return Read([&](Sql& sql) { return FindVersion(sql, id, version); });
  }
  absl::StatusOr<std::vector<pb::FamilyRecord>> ListKeptVersions(const std::string& id) override {
    return Read([&](Sql& sql) { return FindKeptVersions(sql, id); });
  }
  absl::StatusOr<Page<pb::FamilyRecord>> ListFamilies(int page_size,
                                                      const std::string& token) override {
    return Read([&](Sql& sql) { return PageOfFamilies(sql, page_size, token); });
  }
  absl::StatusOr<pb::JobRecord> GetJob(const std::string& id) override {
    LB_ASSIGN_OR_RETURN(JobRow row, Read([&](Sql& sql) { return FindJob(sql, id); }));
    return std::move(row.record);
  }
  absl::StatusOr<Page<pb::JobRecord>> ListJobs(int page_size, const std::string& token) override {
    return Read([&](Sql& sql) { return PageOfJobs(sql, page_size, token); });
  }
  absl::StatusOr<std::vector<pb::JobRecord>> ListChildren(const std::string& job_id) override {
    return Read([&](Sql& sql) { return FindChildren(sql, job_id); });
  }
  absl::StatusOr<JobCounts> CountJobs() override {
    return Read([&](Sql& sql) { return CountJobsByState(sql); });
  }
  absl::StatusOr<JobMemoryCounts> CountJobsByMemory() override {
    return Read([&](Sql& sql) { return CountUnfinishedByMemory(sql); });
  }
  absl::StatusOr<QueueFigures> MeasureQueue(int64_t memory_bytes) override {
    return Read([&](Sql& sql) -> absl::StatusOr<QueueFigures> {
      LB_ASSIGN_OR_RETURN(const absl::Time now, sql.Now());
      return store::MeasureQueue(sql, now, memory_bytes);
    });
  }
  absl::StatusOr<std::vector<pb::JobRecord>> ListEndedJobs(absl::Time after,
                                                           int max_jobs) override {
    return Read([&](Sql& sql) { return FindEndedJobs(sql, after, max_jobs); });
  }
  absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() override {
    LB_ASSIGN_OR_RETURN(std::vector<std::string> blobs,
                        ReadCurrent([](Sql& sql) { return BlobsInUse(sql); }));
    return SortedOnce(std::move(blobs));
  }

  absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions() override {
    return Read([&](Sql& sql) { return store::ListFamilyVersions(sql); });
  }
  absl::StatusOr<KeptVersions> ListKeptNumbers() override {
    return Read([](Sql& sql) { return store::ListKeptNumbers(sql); });
  }
  absl::StatusOr<std::vector<HeldJob>> ListUnfinishedJobs() override {
    return Read([&](Sql& sql) { return store::ListUnfinishedJobs(sql); });
  }
  absl::StatusOr<std::string> Id() override {
    return Read([](Sql& sql) { return FindCatalogId(sql); });
  }

  absl::StatusOr<CatalogInspection> Inspect() override {
    LB_ASSIGN_OR_RETURN(CatalogRows rows, ReadSnapshot([](Sql& sql) { return ReadRows(sql); }));
    CatalogInspection inspection = InspectRows(std::move(rows));
    inspection.blobs = SortedOnce(std::move(inspection.blobs));
    return inspection;
  }
  absl::Status Import(const CatalogContents& contents) override {
    return Change([&](Sql& sql, absl::Time) { return ImportContents(sql, contents); });
  }
  absl::Status CheckImport(const CatalogContents& contents) override {
    return Change([&](Sql& sql, absl::Time) { return CheckNoClash(sql, contents); });
  }
  absl::Status SetAnimationReadable(const std::string& id, const std::string& blob,
                                    const absl::Status& readable) override {
    return Change(
        [&](Sql& sql, absl::Time) { return store::SetAnimationReadable(sql, id, blob, readable); });
  }

  absl::StatusOr<std::vector<OwnerUse>> ListOwners() override {
    return Read([](Sql& sql) { return FindOwners(sql); });
  }
  absl::StatusOr<int64_t> PruneHistory(const PruneOptions& options) override {
    LB_RETURN_IF_ERROR(options.Validate());
    if (options.keep == absl::ZeroDuration()) return 0;
    if (options.dry_run) {
      return Read([&](Sql& sql) -> absl::StatusOr<int64_t> {
        LB_ASSIGN_OR_RETURN(const absl::Time now, sql.Now());
        return CountHistory(sql, now - options.keep);
      });
    }
    int64_t num_pruned = 0;
    while (!options.must_stop || !options.must_stop()) {
      LB_ASSIGN_OR_RETURN(const int64_t num, Change([&](Sql& sql, absl::Time now) {
                            return RemoveHistory(sql, now - options.keep, kPrunedAtOnce);
                          }));
      num_pruned += num;
      if (num < kPrunedAtOnce) break;
    }
    return num_pruned;
  }

  absl::Status RecordFamilyUses(const std::map<std::string, int64_t>& num_frames) override {
    return ChangeJob([&](Sql& sql, absl::Time now) { return AddFamilyUses(sql, num_frames, now); });
  }
  absl::StatusOr<std::vector<UsedFamily>> ListMostUsedFamilies(int max_num) override {
    return Read([&](Sql& sql) -> absl::StatusOr<std::vector<UsedFamily>> {
      LB_ASSIGN_OR_RETURN(const absl::Time now, sql.Now());
      return FindMostUsedFamilies(sql, max_num, now);
    });
  }

  absl::StatusOr<pb::FamilyRecord> RollbackFamily(const std::string& id, int64_t version,
                                                  int keep_versions) override {
    return Change([&](Sql& sql, absl::Time now) -> absl::StatusOr<pb::FamilyRecord> {
      LB_RETURN_IF_ERROR(CheckDone(sql, absl::StrCat("families/", id)));
      return store::RollbackFamily(sql, id, version, keep_versions, now);
    });
  }

  absl::Status DeleteAnimation(const std::string& id) override {
    return Change([&](Sql& sql, absl::Time) -> absl::Status {
      LB_RETURN_IF_ERROR(FindAnimation(sql, id).status());
      LB_RETURN_IF_ERROR(CheckUnneeded(sql, id));
      return RemoveAnimation(sql, id);
    });
  }
  absl::Status DeleteFamily(const std::string& id) override {
    return Change([&](Sql& sql, absl::Time) -> absl::Status {
      LB_RETURN_IF_ERROR(FindFamily(sql, id).status());
      LB_RETURN_IF_ERROR(CheckDone(sql, absl::StrCat("families/", id)));
      return RemoveFamily(sql, id);
    });
  }
  absl::Status DeleteJob(const std::string& id) override {
    return Change([&](Sql& sql, absl::Time) -> absl::Status {
      LB_ASSIGN_OR_RETURN(const JobRow row, FindJob(sql, id));
      if (!IsUnfinished(row.record)) return RemoveJob(sql, id);
      return absl::FailedPreconditionError(absl::StrCat("job '", id, "' is not done"));
    });
  }

  absl::StatusOr<std::optional<Lease>> LeaseJob(const std::string& worker, absl::Duration duration,
                                                int64_t memory_bytes) override {
    LeaseRequest request{.worker = {}, .duration = duration, .outage = {}};
    request.worker.set_name(worker);
    request.worker.set_memory_bytes(memory_bytes);
    RecordWorkerSeen(request.worker).IgnoreError();  // the job counts
    return Watched([&] { return LeaseFor(request); });
  }
  absl::StatusOr<bool> WaitForJob(absl::Duration timeout, int64_t memory_bytes) override {
    return backend_->WaitForJob(timeout, [&] { return UntilNextJob(memory_bytes); });
  }
  absl::Status RecordWorker(const pb::WorkerRecord& worker) override {
    return RecordWorkerSeen(worker);
  }
  absl::StatusOr<std::vector<pb::WorkerRecord>> ListWorkers() override {
    return Read([](Sql& sql) -> absl::StatusOr<std::vector<pb::WorkerRecord>> {
      LB_ASSIGN_OR_RETURN(const absl::Time now, sql.Now());
      return FindWorkers(sql, now - kWorkerSilence);
    });
  }
  absl::StatusOr<JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                       const pb::JobProgress& progress) override {
    RefreshWorkerSeen();
    return Watched([&] {
      return ChangeJob([&](Sql& sql, absl::Time now) {
        return store::Heartbeat(sql, lease_id, duration, progress, now);
      });
    });
  }
  absl::Status SaveCheckpoint(const std::string& lease_id, const std::string& blob) override {
    const absl::Status saved = ChangeJob([&](Sql& sql, absl::Time now) {
      const absl::Status status = store::SaveCheckpoint(sql, lease_id, blob, now);
      if (status.ok()) base::FaultPoint("checkpoint.before_commit");
      return status;
    });
    if (saved.ok()) base::FaultPoint("checkpoint.after_commit");
    return saved;
  }
  absl::Status PublishAnimation(const std::string& lease_id,
                                const pb::AnimationRecord& animation) override {
    return Publish([&](Sql& sql, absl::Time now) {
      return store::PublishAnimation(sql, lease_id, animation, now);
    });
  }
  absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                        const pb::FamilyRecord& family) override {
    return Publish(
        [&](Sql& sql, absl::Time now) { return store::PublishFamily(sql, lease_id, family, now); });
  }
  absl::Status FinishChild(const std::string& lease_id, const std::string& blob) override {
    return Publish(
        [&](Sql& sql, absl::Time now) { return store::FinishChild(sql, lease_id, blob, now); });
  }
  absl::Status RepeatChildren(const std::string& lease_id, const std::vector<std::string>& children,
                              const absl::Status& why) override {
    return Change([&](Sql& sql, absl::Time now) {
      return store::RepeatChildren(sql, lease_id, children, why, now);
    });
  }
  absl::Status FailJob(const std::string& lease_id, const absl::Status& error,
                       bool retry) override {
    return Watched([&] {
      return Change([&](Sql& sql, absl::Time now) {
        return store::FailJob(sql, lease_id, error, retry, options_.retry, now);
      });
    });
  }
  // Beside other changes, since a thousand workers may be stopped at once, and have seconds to give
  // their jobs back.
  absl::Status ReleaseJob(const std::string& lease_id) override {
    LB_ASSIGN_OR_RETURN(const bool is_released, ChangeJob([&](Sql& sql, absl::Time now) {
                          return store::ReleaseJob(sql, lease_id, now);
                        }));
    if (is_released) return absl::OkStatus();
    return Change([&](Sql& sql, absl::Time now) { return CancelLeasedJob(sql, lease_id, now); });
  }
  absl::Status RequestCancel(const std::string& job_id) override {
    return Change([&](Sql& sql, absl::Time now) { return store::RequestCancel(sql, job_id, now); });
  }

 private:
  // The result of the call; the time in which calls fail by transient errors is an outage. For
  // calls about leases: others say little of whether leases can be renewed.
  template <typename Call>
  std::invoke_result_t<Call> Watched(const Call& call) {
    const base::SteadyClock::time_point begin = base::SteadyClock::now();
    auto result = call();
    outages_.Note(begin, StatusOf(result));
    return result;
  }

  absl::StatusOr<std::optional<Lease>> LeaseFor(LeaseRequest& request) {
    const int64_t memory_bytes = request.worker.memory_bytes();
    while (true) {
      // A read first, so that a worker that finds nothing to do does not block writers.
      LB_ASSIGN_OR_RETURN(const absl::Duration until_next, UntilNextJob(memory_bytes));
      if (until_next > absl::ZeroDuration()) return std::optional<Lease>();
      LB_ASSIGN_OR_RETURN(LeaseAttempt attempt, ChangeJob([&](Sql& sql, absl::Time now) {
                            request.outage = outages_.Last(now);
                            return store::LeaseJob(sql, request, options_.retry, now);
                          }));
      if (attempt.next == LeaseAttempt::kTryAgain) continue;
      if (attempt.next != LeaseAttempt::kEndDeadJobs) return std::move(attempt.lease);
      LB_RETURN_IF_ERROR(Change([&](Sql& sql, absl::Time now) {
        return EndDeadJobs(sql, request, options_.retry, now);
      }));
    }
  }

  // Records that the worker is there, at most once in a quarter of kWorkerSilence. After a failure
  // the next call records it again.
  absl::Status RecordWorkerSeen(const pb::WorkerRecord& worker) ABSL_LOCKS_EXCLUDED(worker_mutex_) {
    {
      const absl::MutexLock lock(&worker_mutex_);
      const bool is_same = worker.name() == worker_.name() &&
                           worker.memory_bytes() == worker_.memory_bytes() &&
                           worker.refusal() == worker_.refusal();
      if (is_same && is_recorded_ && base::Since(recorded_at_) < kWorkerSilence / 4) {
        return absl::OkStatus();
      }
      worker_ = worker;
      recorded_at_ = base::SteadyClock::now();
      is_recorded_ = true;
    }
    absl::Cleanup retry = [this] {  // also if the call throws
      const absl::MutexLock lock(&worker_mutex_);
      is_recorded_ = false;
    };
    const absl::Status recorded =
        ChangeJob([&](Sql& sql, absl::Time now) { return SaveWorker(sql, worker, now); });
    if (recorded.ok()) std::move(retry).Cancel();
    return recorded;
  }
  void RefreshWorkerSeen() ABSL_LOCKS_EXCLUDED(worker_mutex_) {
    pb::WorkerRecord worker;
    {
      const absl::MutexLock lock(&worker_mutex_);
      worker = worker_;
    }
    if (!worker.name().empty()) RecordWorkerSeen(worker).IgnoreError();
  }

  absl::StatusOr<absl::Duration> UntilNextJob(int64_t memory_bytes) {
    return Read([&](Sql& sql) -> absl::StatusOr<absl::Duration> {
      LB_ASSIGN_OR_RETURN(const absl::Time now, sql.Now());
      return TimeToNextJob(sql, now, memory_bytes);
    });
  }

  template <typename Body>
  ReadResult<Body> Read(const Body& body) {
    return ReadWith(&SqlBackend::Read, body);
  }
  template <typename Body>
  ReadResult<Body> ReadCurrent(const Body& body) {
    return ReadWith(&SqlBackend::ReadCurrent, body);
  }
  template <typename Body>
  ReadResult<Body> ReadSnapshot(const Body& body) {
    return ReadWith(&SqlBackend::ReadSnapshot, body);
  }

  // body: Sql& -> StatusOr, of statements that change nothing.
  template <typename Body>
  ReadResult<Body> ReadWith(absl::Status (SqlBackend::*run)(SqlBackend::Body), const Body& body) {
    ReadResult<Body> result = absl::UnknownError("not run");
    const absl::Status status = ((*backend_).*run)([&](Sql& sql) {
      result = body(sql);
      return StatusOf(result);
    });
    if (!status.ok()) result = status;
    return result;
  }

  template <typename Body>
  ChangeResult<Body> Change(const Body& body) {
    return Transact(&SqlBackend::Change, body);
  }
  template <typename Body>
  ChangeResult<Body> ChangeShared(const Body& body) {
    return Transact(&SqlBackend::ChangeShared, body);
  }
  template <typename Body>
  ChangeResult<Body> ChangeJob(const Body& body) {
    return Transact(&SqlBackend::ChangeJob, body);
  }

  // body: (Sql&, absl::Time) -> Status or StatusOr. All of its statements, or none of them.
  template <typename Body>
  ChangeResult<Body> Transact(absl::Status (SqlBackend::*run)(SqlBackend::Body), const Body& body) {
    ChangeResult<Body> result = absl::UnknownError("not run");
    const absl::Status status = ((*backend_).*run)([&](Sql& sql) -> absl::Status {
      LB_ASSIGN_OR_RETURN(const absl::Time now, sql.Now());
      result = body(sql, now);
      if (StatusOf(result).ok()) base::FaultPoint("catalog.before_commit");
      return StatusOf(result);
    });
    if (!status.ok()) {
      result = status;
    } else {
      base::FaultPoint("catalog.after_commit");
    }
    return result;
  }

  template <typename Body>
  ChangeResult<Body> Publish(const Body& body) {
    auto result = ChangeShared([&](Sql& sql, absl::Time now) {
      auto published = body(sql, now);
      if (StatusOf(published).ok()) base::FaultPoint("publish.before_commit");
      return published;
    });
    if (StatusOf(result).ok()) base::FaultPoint("publish.after_commit");
    return result;
  }

  const CatalogOptions options_;
  const std::unique_ptr<SqlBackend> backend_;
  OutageWatch outages_;
  absl::Mutex worker_mutex_;
  pb::WorkerRecord worker_ ABSL_GUARDED_BY(worker_mutex_);  // the last one that asked
  base::SteadyClock::time_point recorded_at_ ABSL_GUARDED_BY(worker_mutex_);
  bool is_recorded_ ABSL_GUARDED_BY(worker_mutex_) = false;
};

}  // namespace

absl::Status CheckTablesVersion(const Sql& sql, int64_t version, int64_t lowest, int64_t newest) {
  if (version >= lowest && version <= newest) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("database ", sql.name(), " has schema version ",
                                                    version, "; this program knows 1 to ", newest));
}

std::unique_ptr<Catalog> MakeSqlCatalog(std::unique_ptr<SqlBackend> backend,
                                        const CatalogOptions& options) {
  return std::make_unique<SqlCatalog>(std::move(backend), options);
}

}  // namespace liquidblend::store
