// A catalog in front of another one, for tests that have to be in between.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/store/catalog/catalog.h"

namespace liquidblend::store {

// Passes every call on to the other one, which outlives it.
class ForwardingCatalog : public Catalog {
 public:
  explicit ForwardingCatalog(Catalog& catalog) : catalog_(catalog) {}

  absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions() override {
    return catalog_.ListFamilyVersions();
  }
  absl::StatusOr<KeptVersions> ListKeptNumbers() override { return catalog_.ListKeptNumbers(); }
  absl::StatusOr<std::vector<HeldJob>> ListUnfinishedJobs() override {
    return catalog_.ListUnfinishedJobs();
  }
  absl::StatusOr<std::string> Id() override { return catalog_.Id(); }
  absl::StatusOr<CatalogInspection> Inspect() override { return catalog_.Inspect(); }
  absl::Status Import(const CatalogContents& contents) override {
    return catalog_.Import(contents);
  }
  absl::Status CheckImport(const CatalogContents& contents) override {
    return catalog_.CheckImport(contents);
  }
  absl::StatusOr<std::vector<OwnerUse>> ListOwners() override { return catalog_.ListOwners(); }
  absl::StatusOr<int64_t> PruneHistory(const PruneOptions& options) override {
    return catalog_.PruneHistory(options);
  }
  absl::Status SetAnimationReadable(const std::string& id, const std::string& blob,
                                    const absl::Status& readable) override {
    return catalog_.SetAnimationReadable(id, blob, readable);
  }
  absl::StatusOr<pb::JobRecord> SubmitImport(const pb::AnimationRecord& animation,
                                             pb::JobRecord job, const OwnerCheck& check) override {
    return catalog_.SubmitImport(animation, job, check);
  }
  absl::StatusOr<pb::JobRecord> SubmitRegistration(pb::JobRecord job,
                                                   const OwnerCheck& check) override {
    return catalog_.SubmitRegistration(job, check);
  }
  absl::Status CheckOwner(const pb::JobRecord& job, const OwnerCheck& check) override {
    return catalog_.CheckOwner(job, check);
  }
  absl::StatusOr<pb::AnimationRecord> GetAnimation(const std::string& id) override {
    return catalog_.GetAnimation(id);
  }
  absl::StatusOr<Page<pb::AnimationRecord>> ListAnimations(int page_size,
                                                           const std::string& token) override {
    return catalog_.ListAnimations(page_size, token);
  }
  absl::StatusOr<pb::FamilyRecord> GetFamily(const std::string& id) override {
    return catalog_.GetFamily(id);
  }
  absl::StatusOr<pb::FamilyRecord> GetFamilyVersion(const std::string& id,
                                                    int64_t version) override {
    return catalog_.GetFamilyVersion(id, version);
  }
  absl::StatusOr<std::vector<pb::FamilyRecord>> ListKeptVersions(const std::string& id) override {
    return catalog_.ListKeptVersions(id);
  }
  absl::StatusOr<Page<pb::FamilyRecord>> ListFamilies(int page_size,
                                                      const std::string& token) override {
    return catalog_.ListFamilies(page_size, token);
  }
  absl::StatusOr<pb::JobRecord> GetJob(const std::string& id) override {
    return catalog_.GetJob(id);
  }
  absl::StatusOr<Page<pb::JobRecord>> ListJobs(int page_size, const std::string& token) override {
    return catalog_.ListJobs(page_size, token);
  }
  absl::StatusOr<std::vector<pb::JobRecord>> ListChildren(const std::string& job_id) override {
    return catalog_.ListChildren(job_id);
  }
  absl::StatusOr<JobCounts> CountJobs() override { return catalog_.CountJobs(); }
  absl::StatusOr<JobMemoryCounts> CountJobsByMemory() override {
    return catalog_.CountJobsByMemory();
  }
  absl::StatusOr<QueueFigures> MeasureQueue(int64_t memory_bytes) override {
    return catalog_.MeasureQueue(memory_bytes);
  }
  absl::StatusOr<std::vector<pb::JobRecord>> ListEndedJobs(absl::Time after,
                                                           int max_jobs) override {
    return catalog_.ListEndedJobs(after, max_jobs);
  }
  absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() override {
    return catalog_.ListReferencedBlobs();
  }
  absl::Status RecordFamilyUses(const std::map<std::string, int64_t>& num_frames) override {
    return catalog_.RecordFamilyUses(num_frames);
  }
  absl::StatusOr<std::vector<UsedFamily>> ListMostUsedFamilies(int max_num) override {
    return catalog_.ListMostUsedFamilies(max_num);
  }
  absl::StatusOr<pb::FamilyRecord> RollbackFamily(const std::string& id, int64_t version,
                                                  int keep_versions) override {
    return catalog_.RollbackFamily(id, version, keep_versions);
  }
  absl::Status DeleteAnimation(const std::string& id) override {
    return catalog_.DeleteAnimation(id);
  }
  absl::Status DeleteFamily(const std::string& id) override { return catalog_.DeleteFamily(id); }
  absl::Status DeleteJob(const std::string& id) override { return catalog_.DeleteJob(id); }
  absl::StatusOr<std::optional<Lease>> LeaseJob(const std::string& worker, absl::Duration duration,
                                                int64_t memory_bytes) override {
    return catalog_.LeaseJob(worker, duration, memory_bytes);
  }
  absl::StatusOr<bool> WaitForJob(absl::Duration timeout, int64_t memory_bytes) override {
    return catalog_.WaitForJob(timeout, memory_bytes);
  }
  absl::Status RecordWorker(const pb::WorkerRecord& worker) override {
    return catalog_.RecordWorker(worker);
  }
  absl::StatusOr<std::vector<pb::WorkerRecord>> ListWorkers() override {
    return catalog_.ListWorkers();
  }
  absl::StatusOr<JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                       const pb::JobProgress& progress) override {
    return catalog_.Heartbeat(lease_id, duration, progress);
  }
  absl::Status SaveCheckpoint(const std::string& lease_id, const std::string& blob) override {
    return catalog_.SaveCheckpoint(lease_id, blob);
  }
  absl::Status PublishAnimation(const std::string& lease_id,
                                const pb::AnimationRecord& animation) override {
    return catalog_.PublishAnimation(lease_id, animation);
  }
  absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                        const pb::FamilyRecord& family) override {
    return catalog_.PublishFamily(lease_id, family);
  }
  absl::Status FinishChild(const std::string& lease_id, const std::string& blob) override {
    return catalog_.FinishChild(lease_id, blob);
  }
  absl::Status RepeatChildren(const std::string& lease_id, const std::vector<std::string>& children,
                              const absl::Status& why) override {
    return catalog_.RepeatChildren(lease_id, children, why);
  }
  absl::Status FailJob(const std::string& lease_id, const absl::Status& error,
                       bool retry) override {
    return catalog_.FailJob(lease_id, error, retry);
  }
  absl::Status ReleaseJob(const std::string& lease_id) override {
    return catalog_.ReleaseJob(lease_id);
  }
  absl::Status RequestCancel(const std::string& job_id) override {
    return catalog_.RequestCancel(job_id);
  }

 private:
  Catalog& catalog_;
};

}  // namespace liquidblend::store
