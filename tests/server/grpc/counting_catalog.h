// A catalog that counts how often it is asked for what many clients may ask for at once.
#pragma once

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/store/catalog/catalog.h"

namespace liquidblend::server {

// Another one, which outlives it.
class CountingCatalog : public store::Catalog {
 public:
  explicit CountingCatalog(store::Catalog& catalog) : catalog_(catalog) {}

  int num_jobs_read() const { return num_jobs_read_; }
  int num_lists_of_workers() const { return num_lists_of_workers_; }

  absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions() override {
    return catalog_.ListFamilyVersions();
  }
  absl::StatusOr<store::KeptVersions> ListKeptNumbers() override {
    return catalog_.ListKeptNumbers();
  }
  absl::StatusOr<std::vector<store::HeldJob>> ListUnfinishedJobs() override {
    return catalog_.ListUnfinishedJobs();
  }
  absl::StatusOr<std::string> Id() override { return catalog_.Id(); }
  absl::StatusOr<store::CatalogInspection> Inspect() override { return catalog_.Inspect(); }
  absl::Status Import(const store::CatalogContents& contents) override {
    return catalog_.Import(contents);
  }
  absl::Status CheckImport(const store::CatalogContents& contents) override {
    return catalog_.CheckImport(contents);
  }
  absl::StatusOr<std::vector<store::OwnerUse>> ListOwners() override {
    return catalog_.ListOwners();
  }
  absl::StatusOr<int64_t> PruneHistory(const store::PruneOptions& options) override {
    return catalog_.PruneHistory(options);
  }
  absl::Status SetAnimationReadable(const std::string& id, const std::string& blob,
                                    const absl::Status& readable) override {
    return catalog_.SetAnimationReadable(id, blob, readable);
  }
  absl::StatusOr<store::pb::JobRecord> SubmitImport(const store::pb::AnimationRecord& animation,
                                                    store::pb::JobRecord job,
                                                    const store::OwnerCheck& check) override {
    return catalog_.SubmitImport(animation, job, check);
  }
  absl::StatusOr<store::pb::JobRecord> SubmitRegistration(store::pb::JobRecord job,
                                                          const store::OwnerCheck& check) override {
    return catalog_.SubmitRegistration(job, check);
  }
  absl::Status CheckOwner(const store::pb::JobRecord& job,
                          const store::OwnerCheck& check) override {
    return catalog_.CheckOwner(job, check);
  }
  absl::StatusOr<store::pb::AnimationRecord> GetAnimation(const std::string& id) override {
    return catalog_.GetAnimation(id);
  }
  absl::StatusOr<store::Page<store::pb::AnimationRecord>> ListAnimations(
      int page_size, const std::string& token) override {
    return catalog_.ListAnimations(page_size, token);
  }
  absl::StatusOr<store::pb::FamilyRecord> GetFamily(const std::string& id) override {
    return catalog_.GetFamily(id);
  }
  absl::StatusOr<store::pb::FamilyRecord> GetFamilyVersion(const std::string& id,
                                                           int64_t version) override {
    return catalog_.GetFamilyVersion(id, version);
  }
  absl::StatusOr<std::vector<store::pb::FamilyRecord>> ListKeptVersions(
      const std::string& id) override {
    return catalog_.ListKeptVersions(id);
  }
  absl::StatusOr<store::Page<store::pb::FamilyRecord>> ListFamilies(
      int page_size, const std::string& token) override {
    return catalog_.ListFamilies(page_size, token);
  }
  absl::StatusOr<store::pb::JobRecord> GetJob(const std::string& id) override {
    ++num_jobs_read_;
    return catalog_.GetJob(id);
  }
  absl::StatusOr<store::Page<store::pb::JobRecord>> ListJobs(int page_size,
                                                             const std::string& token) override {
    return catalog_.ListJobs(page_size, token);
  }
  absl::StatusOr<std::vector<store::pb::JobRecord>> ListChildren(
      const std::string& job_id) override {
    return catalog_.ListChildren(job_id);
  }
  absl::StatusOr<store::JobCounts> CountJobs() override { return catalog_.CountJobs(); }
  absl::StatusOr<store::JobMemoryCounts> CountJobsByMemory() override {
    return catalog_.CountJobsByMemory();
  }
  absl::StatusOr<store::QueueFigures> MeasureQueue(int64_t memory_bytes) override {
    return catalog_.MeasureQueue(memory_bytes);
  }
  absl::StatusOr<std::vector<store::pb::JobRecord>> ListEndedJobs(absl::Time after,
                                                                  int max_jobs) override {
    return catalog_.ListEndedJobs(after, max_jobs);
  }
  absl::StatusOr<std::vector<std::string>> ListReferencedBlobs() override {
    return catalog_.ListReferencedBlobs();
  }
  absl::Status RecordFamilyUses(const std::map<std::string, int64_t>& num_frames) override {
    return catalog_.RecordFamilyUses(num_frames);
  }
  absl::StatusOr<std::vector<store::UsedFamily>> ListMostUsedFamilies(int max_num) override {
    return catalog_.ListMostUsedFamilies(max_num);
  }
  absl::StatusOr<store::pb::FamilyRecord> RollbackFamily(const std::string& id, int64_t version,
                                                         int keep_versions) override {
    return catalog_.RollbackFamily(id, version, keep_versions);
  }
  absl::Status DeleteAnimation(const std::string& id) override {
    return catalog_.DeleteAnimation(id);
  }
  absl::Status DeleteFamily(const std::string& id) override { return catalog_.DeleteFamily(id); }
  absl::Status DeleteJob(const std::string& id) override { return catalog_.DeleteJob(id); }
  absl::StatusOr<std::optional<store::Lease>> LeaseJob(const std::string& worker,
                                                       absl::Duration duration,
                                                       int64_t memory_bytes) override {
    return catalog_.LeaseJob(worker, duration, memory_bytes);
  }
  absl::StatusOr<bool> WaitForJob(absl::Duration timeout, int64_t memory_bytes) override {
    return catalog_.WaitForJob(timeout, memory_bytes);
  }
  absl::Status RecordWorker(const store::pb::WorkerRecord& worker) override {
    return catalog_.RecordWorker(worker);
  }
  absl::StatusOr<std::vector<store::pb::WorkerRecord>> ListWorkers() override {
    ++num_lists_of_workers_;
    return catalog_.ListWorkers();
  }
  absl::StatusOr<store::JobControl> Heartbeat(const std::string& lease_id, absl::Duration duration,
                                              const store::pb::JobProgress& progress) override {
    return catalog_.Heartbeat(lease_id, duration, progress);
  }
  absl::Status SaveCheckpoint(const std::string& lease_id, const std::string& blob) override {
    return catalog_.SaveCheckpoint(lease_id, blob);
  }
  absl::Status PublishAnimation(const std::string& lease_id,
                                const store::pb::AnimationRecord& animation) override {
    return catalog_.PublishAnimation(lease_id, animation);
  }
  absl::StatusOr<int64_t> PublishFamily(const std::string& lease_id,
                                        const store::pb::FamilyRecord& family) override {
    return catalog_.PublishFamily(lease_id, family);
  }
  absl::Status FinishChild(const std::string& lease_id, const std::string& blob) override {
    return catalog_.FinishChild(lease_id, blob);
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
  store::Catalog& catalog_;
  std::atomic<int> num_jobs_read_ = 0;
  std::atomic<int> num_lists_of_workers_ = 0;
};

}  // namespace liquidblend::server
