#include "server/admin/check.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/catalog_file.h"
#include "core/store/catalog/job_records.h"
#include "core/store/data_directory.h"
#include "core/store/files/files.h"
#include "core/store/sql/sqlite.h"

namespace liquidblend::admin {
namespace {

using Names = std::vector<std::string>;

// Blobs and who refers to them.
using Uses = std::map<store::BlobId, Names>;

// SQLite's own check of its file; nothing if there is no fault.
absl::StatusOr<Names> FaultsOfDatabase(const std::string& path) {
  Names faults;
  const auto db = store::Database::Open(path, absl::Seconds(10));
  absl::Status status = db.status();
  if (status.ok()) {
    status = (*db)->Run("PRAGMA integrity_check", {}, [&](const store::SqlRow& row) {
      const std::string verdict = row.String(0);
      if (verdict != "ok") faults.push_back(absl::StrCat("database ", path, ": ", verdict));
      return absl::OkStatus();
    });
  }
  if (absl::IsDataLoss(status)) faults.emplace_back(status.message());
  if (!status.ok() && !absl::IsDataLoss(status)) return status;
  return faults;
}

Damage DamageOfCatalog(const std::string& fault) {
  return {.blob = "", .error = absl::DataLossError(fault), .needed_by = {}, .repair = ""};
}

// Users of each referenced blob, according to the readable records; has all referenced blobs.
Uses FindUses(const store::CatalogInspection& inspection) {
  Uses uses;
  for (const std::string& blob : inspection.blobs) uses[blob];
  const auto add = [&](const google::protobuf::Message& record, const std::string& name) {
    for (const store::BlobId& blob : store::BlobIdsIn(record)) {
      const auto found = uses.find(blob);
      if (found != uses.end()) found->second.push_back(name);
    }
  };
  const store::CatalogContents& contents = inspection.contents;
  for (const auto& animation : contents.animations) {
    add(animation, absl::StrCat("animations/", animation.id()));
  }
  for (const auto& family : contents.families) add(family, absl::StrCat("families/", family.id()));
  for (const auto& kept : contents.kept_versions) {
    add(kept, absl::StrCat("families/", kept.id(), " version ", kept.version()));
  }
  for (const auto& job : contents.jobs) {
    if (store::IsUnfinished(job) || !job.parent().empty()) {
      add(job, absl::StrCat("jobs/", job.id()));
    }
  }
  return uses;
}

class Checker {
 public:
  Checker(const store::Store& store, const parallel::Arena& arena, Progress& progress,
          const CheckOptions& options)
      : store_(store), arena_(arena), progress_(progress), options_(options) {}

  absl::Status Run(CheckReport& report) {
    LB_ASSIGN_OR_RETURN(store::CatalogInspection inspection, store_.catalog->Inspect());
    for (const std::string& fault : inspection.damage) {
      report.damage.push_back(DamageOfCatalog(fault));
    }
    // In this order: what is committed and referred to meanwhile is not missed.
    uses_ = FindUses(inspection);
    contents_ = std::move(inspection.contents);
    report.num_animations = static_cast<int64_t>(contents_.animations.size());
    report.num_families = static_cast<int64_t>(contents_.families.size());
    report.num_jobs = static_cast<int64_t>(contents_.jobs.size());
    LB_ASSIGN_OR_RETURN(std::vector<store::BlobInfo> blobs, store_.blobs->List());
    Count(blobs, report);
    AddUnlisted(blobs);
    LB_ASSIGN_OR_RETURN(std::vector<Damage> damage, FindDamage(blobs));
    if (options_.repair) LB_RETURN_IF_ERROR(Repair(damage, report));
    std::move(damage.begin(), damage.end(), std::back_inserter(report.damage));
    return absl::OkStatus();
  }

 private:
  void Count(const std::vector<store::BlobInfo>& blobs, CheckReport& report) const {
    for (const store::BlobInfo& blob : blobs) {
      ++report.num_blobs;
      report.num_bytes += blob.size_bytes;
      if (uses_.contains(blob.id)) continue;
      ++report.num_unreferenced;
      report.unreferenced_bytes += blob.size_bytes;
    }
  }

  // A listing may lag behind: a blob that is needed and not listed is looked for by its name.
  void AddUnlisted(std::vector<store::BlobInfo>& blobs) const {
    std::set<store::BlobId> listed;
    for (const store::BlobInfo& blob : blobs) listed.insert(blob.id);
    for (const auto& [id, names] : uses_) {
      if (!listed.contains(id)) blobs.push_back({.id = id, .size_bytes = 0, .modified = {}});
    }
  }

  // The damaged blobs, in the order of their ids.
  // Errors: a transient one of reading a blob, which does not mean damage.
  absl::StatusOr<std::vector<Damage>> FindDamage(const std::vector<store::BlobInfo>& blobs) {
    std::map<store::BlobId, absl::Status> faults;
    for (const auto& [id, names] : uses_) {
      faults[id] = absl::NotFoundError(absl::StrCat("blob ", id, " is missing"));
    }
    const std::vector<absl::Status> verdicts = VerifyAll(blobs);
    for (size_t k = 0; k < blobs.size(); ++k) {
      if (base::IsTransient(verdicts[k])) return verdicts[k];
      // One that is gone by now may have been collected.
      if (!absl::IsNotFound(verdicts[k])) faults[blobs[k].id] = verdicts[k];
    }
    for (const auto* families : {&contents_.families, &contents_.kept_versions}) {
      for (const store::pb::FamilyRecord& family : *families) {
        absl::Status& fault = faults[family.blob()];
        if (!family.blob().empty() && fault.ok()) fault = OpenFamily(family);
        if (base::IsTransient(fault)) return fault;
      }
    }
    // Blobs that were replaced or deleted meanwhile are not missing.
    LB_ASSIGN_OR_RETURN(const Names in_use, store_.catalog->ListReferencedBlobs());
    std::vector<Damage> damage;
    for (const auto& [id, fault] : faults) {
      const bool is_used = std::binary_search(in_use.begin(), in_use.end(), id);
      if (fault.ok() || (absl::IsNotFound(fault) && !is_used)) continue;
      damage.push_back({.blob = id, .error = fault, .needed_by = uses_[id], .repair = ""});
    }
    return damage;
  }

  std::vector<absl::Status> VerifyAll(const std::vector<store::BlobInfo>& blobs) {
    int64_t total_bytes = 0;
    for (const store::BlobInfo& blob : blobs) total_bytes += blob.size_bytes;
    progress_.Begin("checked", total_bytes);
    std::vector<absl::Status> verdicts(blobs.size());
    arena_.For(
        static_cast<int64_t>(blobs.size()),
        [&](int64_t k) {
          verdicts[k] = store_.blobs->Verify(blobs[k].id);
          progress_.Add(blobs[k].size_bytes);
        },
        /*chunk_size=*/1);
    progress_.End();
    return verdicts;
  }

  absl::Status OpenFamily(const store::pb::FamilyRecord& family) {
    LB_ASSIGN_OR_RETURN(std::shared_ptr<const store::Blob> blob, store_.blobs->Open(family.blob()));
    const absl::Status opened = store::OpenFamily(blob, family.blob()).status();
    LB_RETURN_IF_ERROR(blob->Check());  // first: zeros look like a bad file
    return opened;
  }

  absl::Status Repair(std::vector<Damage>& damage, CheckReport& report) {
    std::map<store::BlobId, absl::Status> lost;
    for (Damage& item : damage) {
      LB_RETURN_IF_ERROR(RepairBlob(item));
      lost[item.blob] = item.error;
    }
    for (const store::pb::AnimationRecord& animation : contents_.animations) {
      if (animation.blob().empty()) continue;
      LB_RETURN_IF_ERROR(TellIfReadable(animation, lost, damage, report));
    }
    return absl::OkStatus();
  }

  absl::Status RepairBlob(Damage& item) {
    if (!absl::IsDataLoss(item.error)) return absl::OkStatus();
    const auto copy = store_.blobs->Open(item.blob);  // the cache may have it
    const absl::StatusOr<std::string> aside = store_.blobs->Quarantine(item.blob);
    if (absl::IsFailedPrecondition(aside.status())) return absl::OkStatus();  // the file's fault
    if (!aside.ok()) return aside.status();
    item.repair = absl::StrCat("moved to ", *aside);
    if (!copy.ok() || store::IsUploadId(item.blob)) return absl::OkStatus();
    const absl::Status put = store::PutBlobAs(*store_.blobs, item.blob, (*copy)->bytes());
    if (const absl::Status readable = (*copy)->Check(); !put.ok() && !readable.ok()) {
      absl::StrAppend(&item.repair, "; not put again from the cache: ", readable.message());
      return absl::OkStatus();
    }
    LB_RETURN_IF_ERROR(put);
    absl::StrAppend(&item.repair, "; put again from the cache");
    return absl::OkStatus();
  }

  absl::Status TellIfReadable(const store::pb::AnimationRecord& animation,
                              const std::map<store::BlobId, absl::Status>& lost,
                              std::vector<Damage>& damage, CheckReport& report) {
    const bool was_lost = animation.state() == store::pb::AnimationRecord::FAILED;
    const auto found = lost.find(animation.blob());
    const absl::Status verdict =
        found == lost.end() ? absl::OkStatus() : store_.blobs->Verify(animation.blob());
    if (base::IsTransient(verdict)) return verdict;
    const bool is_back = verdict.ok();
    if (is_back == !was_lost) return absl::OkStatus();
    const std::string name = absl::StrCat("animations/", animation.id());
    if (is_back) {
      report.repaired.push_back(name);
      return store_.catalog->SetAnimationReadable(animation.id(), animation.blob(),
                                                  absl::OkStatus());
    }
    for (Damage& item : damage) {
      if (item.blob != animation.blob()) continue;
      absl::StrAppend(&item.repair, item.repair.empty() ? "" : "; ", name, " is FAILED");
    }
    return store_.catalog->SetAnimationReadable(
        animation.id(), animation.blob(),
        absl::DataLossError(absl::StrCat("its file is lost: ", found->second.message())));
  }

  const store::Store& store_;
  const parallel::Arena& arena_;
  Progress& progress_;
  const CheckOptions& options_;
  store::CatalogContents contents_;
  Uses uses_;
};

}  // namespace

absl::StatusOr<CheckReport> CheckStore(const store::Store& store, const parallel::Arena& arena,
                                       Progress& progress, const CheckOptions& options) {
  CheckReport report;
  LB_RETURN_IF_ERROR(Checker(store, arena, progress, options).Run(report));
  return report;
}

absl::StatusOr<CheckReport> Check(const store::StoreLocation& location,
                                  const parallel::Arena& arena, Progress& progress,
                                  const CheckOptions& options) {
  LB_RETURN_IF_ERROR(location.Validate());
  CheckReport report;
  if (!location.is_shared()) {
    LB_ASSIGN_OR_RETURN(const Names faults, FaultsOfDatabase(store::CatalogPath(location.data)));
    for (const std::string& fault : faults) report.damage.push_back(DamageOfCatalog(fault));
  }
  const absl::StatusOr<store::Store> store = store::OpenStore(location);
  // Without a catalog nobody knows what the blobs are for.
  if (absl::IsDataLoss(store.status()) && !report.damage.empty()) return report;
  if (!store.ok()) return store.status();
  LB_RETURN_IF_ERROR(Checker(*store, arena, progress, options).Run(report));
  return report;
}

}  // namespace liquidblend::admin
