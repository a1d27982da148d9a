#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "core/store/catalog.h"
#include "core/store/fault_point.h"
#include "core/store/job_records.h"
#include "core/store/posix_file.h"
#include "core/store/sqlite.h"
#include "core/store/sqlite_queue.h"
#include "core/store/sqlite_tables.h"

namespace liquidblend::store {
namespace {

// The result of a body that runs inside a transaction.
template <typename Body>
using ResultOf = decltype(std::declval<Body>()(std::declval<Database&>()));

absl::Status StatusOf(const absl::Status& result) { return result; }
template <typename T>
absl::Status StatusOf(const absl::StatusOr<T>& result) {
  return result.status();
}

absl::Status CheckDone(Database& db, const std::string& subject) {
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> jobs, FindUnfinishedJobs(db));
  for (const pb::JobRecord& job : jobs) {
    if (SubjectOf(job) != subject) continue;
    return absl::FailedPreconditionError(
        absl::StrCat(subject, " is needed by job '", job.id(), "', which is not done"));
  }
  return absl::OkStatus();
}

absl::Status CheckUnneeded(Database& db, const std::string& animation) {
  LB_ASSIGN_OR_RETURN(const std::string family, FindFamilyWith(db, animation));
  if (!family.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("animation '", animation, "' is part of family '", family, "'"));
  }
  LB_ASSIGN_OR_RETURN(const std::vector<pb::JobRecord> jobs, FindUnfinishedJobs(db));
  for (const pb::JobRecord& job : jobs) {
    for (const std::string& id : AnimationsOf(job)) {
      if (id != animation) continue;
      return absl::FailedPreconditionError(absl::StrCat(
          "animation '", animation, "' is needed by job '", job.id(), "', which is not done"));
    }
  }
  return absl::OkStatus();
}

class SqliteCatalog : public Catalog {
 public:
  SqliteCatalog(std::unique_ptr<Database> db, const CatalogOptions& options)
      : options_(options), db_(std::move(db)) {}

  absl::StatusOr<pb::JobRecord> SubmitImport(const pb::AnimationRecord& animation,
                                             pb::JobRecord job) override {
    return Change([&](Database& db) { return store::SubmitImport(db, animation, job, Now()); });
  }
  absl::StatusOr<pb::JobRecord> SubmitRegistration(pb::JobRecord job) override {
    return Change([&](Database& db) { return store::SubmitRegistration(db, job, Now()); });
  }

  absl::StatusOr<pb::AnimationRecord> GetAnimation(const std::string& id) override {
    return Read([&](Database& db) { return FindAnimation(db, id); });
  }
  absl::StatusOr<Page<pb::AnimationRecord>> ListAnimations(int page_size,
                                                           const std::string& token) override {
    return Read([&](Database& db) { return PageOfAnimations(db, page_size, token); });
  }
  absl::StatusOr<pb::FamilyRecord> GetFamily(const std::string& id) override {
    return Read([&](Database& db) { return FindFamily(db, id); });
  }
  absl::StatusOr<Page<pb::FamilyRecord>> ListFamilies(int page_size,
                                                      const std::string& token) override {
    return Read([&](Database& db) { return PageOfFamilies(db, page_size, token); });
  }
  absl::StatusOr<pb::JobRecord> GetJob(const std::string& id) override {
    LB_ASSIGN_OR_RETURN(JobRow row, Read([&](Database& db) { return FindJob(db, id); }));
    return std::move(row.record);
  }
  absl::StatusOr<Page<pb::JobRecord>> ListJobs(int page_size, const std::string& token) override {
    return Read([&](Database& db) { return PageOfJobs(db, page_size, token); });
  }
  absl::StatusOr<std::vector<pb::JobRecord>> ListParts(const std::string& job_id) override {
    return Read([&](Database& db) { return FindParts(db, job_id); });
  }
  absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() override {
    return Change([&](Database& db) { return BlobsInUse(db); });  // all tables at one moment
  }

  absl::Status DeleteAnimation(const std::string& id) override {
    return Change([&](Database& db) -> absl::Status {
      LB_RETURN_IF_ERROR(FindAnimation(db, id).status());
      LB_RETURN_IF_ERROR(CheckUnneeded(db, id));
      return RemoveAnimation(db, id);
    });
  }
  absl::Status DeleteFamily(const std::string& id) override {
    return Change([&](Database& db) -> absl::Status {
      LB_RETURN_IF_ERROR(FindFamily(db, id).status());
      LB_RETURN_IF_ERROR(CheckDone(db, absl::StrCat("families/", id)));
      return RemoveFamily(db, id);
    });
  }
  absl::Status DeleteJob(const std::string& id) override {
    return Change([&](Database& db) -> absl::Status {
      LB_ASSIGN_OR_RETURN(const JobRow row, FindJob(db, id));
      if (!IsUnfinished(row.record)) return RemoveJob(db, id);
      return absl::FailedPreconditionError(absl::StrCat("job '", id, "' is not done"));
    });
  }

  absl::StatusOr<std::optional<Lease>> LeaseJob(const std::string& worker,
                                                absl::Duration duration) override {
    // A worker that finds nothing to do must not hold up those that write.
    LB_ASSIGN_OR_RETURN(const std::optional<JobRow> job, Read([&](Database& db) {
                          return FindJobToDo(db, absl::ToUnixMicros(Now()));
                        }));
    if (!job.has_value()) return std::optional<Lease>();
    return Change([&](Database& db) {
      return store::LeaseJob(db, worker, duration, options_.max_attempts, Now());
    });
  }
  absl::StatusOr<JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                       const pb::JobProgress& progress) override {
    return Change(
        [&](Database& db) { return store::Heartbeat(db, lease_id, duration, progress, Now()); });
  }
  absl::Status PublishAnimation(const std::string& lease_id,
                                const pb::AnimationRecord& animation) override {
    return Publish(
        [&](Database& db) { return store::PublishAnimation(db, lease_id, animation, Now()); });
  }
  absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                        const pb::FamilyRecord& family) override {
    return Publish([&](Database& db) { return store::PublishFamily(db, lease_id, family, Now()); });
  }
  absl::Status FinishPart(const std::string& lease_id, const std::string& blob) override {
    return Publish([&](Database& db) { return store::FinishPart(db, lease_id, blob, Now()); });
  }
  absl::Status FailJob(const std::string& lease_id, const absl::Status& error,
                       bool retry) override {
    return Change([&](Database& db) {
      return store::FailJob(db, lease_id, error, retry, options_.max_attempts, Now());
    });
  }
  absl::Status ReleaseJob(const std::string& lease_id) override {
    return Change([&](Database& db) { return store::ReleaseJob(db, lease_id, Now()); });
  }
  absl::Status RequestCancel(const std::string& job_id) override {
    return Change([&](Database& db) { return store::RequestCancel(db, job_id, Now()); });
  }

 private:
  absl::Time Now() const { return options_.now ? options_.now() : absl::Now(); }

  // body: Database& -> Status or StatusOr, of one statement.
  template <typename Body>
  ResultOf<Body> Read(const Body& body) ABSL_LOCKS_EXCLUDED(mutex_) {
    const absl::MutexLock lock(&mutex_);
    return body(*db_);
  }

  // All of the body's statements, or none of them.
  template <typename Body>
  ResultOf<Body> Change(const Body& body) ABSL_LOCKS_EXCLUDED(mutex_) {
    const absl::MutexLock lock(&mutex_);
    Database& db = *db_;
    ResultOf<Body> result = absl::UnknownError("not run");
    const absl::Status status = db.Transaction([&] {
      result = body(db);
      if (StatusOf(result).ok()) FaultPoint("catalog.before_commit");
      return StatusOf(result);
    });
    if (!status.ok()) return status;
    FaultPoint("catalog.after_commit");
    return result;
  }

  template <typename Body>
  ResultOf<Body> Publish(const Body& body) ABSL_LOCKS_EXCLUDED(mutex_) {
    auto result = Change([&](Database& db) {
      auto published = body(db);
      if (StatusOf(published).ok()) FaultPoint("publish.before_commit");
      return published;
    });
    if (StatusOf(result).ok()) FaultPoint("publish.after_commit");
    return result;
  }

  const CatalogOptions options_;
  absl::Mutex mutex_;
  const std::unique_ptr<Database> db_ ABSL_PT_GUARDED_BY(mutex_);
};

}  // namespace

absl::StatusOr<std::unique_ptr<Catalog>> OpenSqliteCatalog(const std::string& path,
                                                           const CatalogOptions& options) {
  LB_RETURN_IF_ERROR(options.Validate());
  const size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  LB_RETURN_IF_ERROR(MakeDirectories(folder));
  LB_ASSIGN_OR_RETURN(std::unique_ptr<Database> db, Database::Open(path, options.busy_timeout));
  LB_RETURN_IF_ERROR(PrepareTables(*db));
  LB_RETURN_IF_ERROR(SyncDirectory(folder));
  return std::make_unique<SqliteCatalog>(std::move(db), options);
}

}  // namespace liquidblend::store
