// Upkeep of a catalog: inspection, export and import, history, unfinished jobs, owners.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "liquidblend/store/v1/export.pb.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::store {

namespace pb = ::liquidblend::store::v1;

// All records of a catalog, each in the order of its ids, jobs as they were submitted.
struct CatalogContents {
  std::vector<pb::AnimationRecord> animations;
  std::vector<pb::FamilyRecord> families;
  std::vector<pb::FamilyRecord> kept_versions;  // by family and version
  std::vector<pb::FamilyMember> members;        // of the published and the kept versions
  std::vector<pb::FamilyVersion> versions;  // the last ones ever given, deleted families included
  std::vector<pb::JobRecord> jobs;          // and children of jobs
};

// Contents of a catalog, with what is damaged in it.
struct CatalogInspection {
  CatalogContents contents;         // without unreadable records
  std::vector<std::string> blobs;   // as Catalog::ListReferencedBlobs()
  std::vector<std::string> damage;  // records that cannot be read or contradict others, by name
};

// Numbers of the versions that are kept beside the published one, by family.
using KeptVersions = std::map<std::string, std::set<int64_t>>;

// An unfinished job, and the end of its lease.
struct HeldJob {
  pb::JobRecord job;
  absl::Time lease_expires = absl::InfinitePast();  // of one that is RUNNING
};

// Use of the store by an owner (a principal's name).
struct OwnerUse {
  std::string owner;
  // The files of animations and families, each once, and the uploaded files of unfinished imports.
  int64_t stored_bytes = 0;
  int64_t num_queued_jobs = 0;  // accepted, and not done; children do not count
  int64_t num_animations = 0;   // set by ListOwners()
  int64_t num_families = 0;     // whose published version is this owner's
};

// Options of PruneHistory().
struct PruneOptions {
  absl::Duration keep = absl::Hours(24 * 30);  // >= 0, after the end of a job; 0: for ever
  bool dry_run = false;                        // only count
  std::function<bool()> must_stop = {};        // asked now and then; empty: never
  absl::Status Validate() const;               // names the first field out of range, and its value
};

// Interface to the upkeep of a catalog, a part of Catalog. Errors and threads: as Catalog.
class CatalogUpkeep {
 public:
  virtual ~CatalogUpkeep() = default;

  // The id of this catalog, random and for ever; a copy of the database has the same.
  // Errors: kFailedPrecondition if there is none yet: no user who may create tables has opened it.
  virtual absl::StatusOr<std::string> Id() = 0;

  // The published version of each family, 0 if it has none yet; shows changes by other programs.
  // Cost: one query; meant for every second.
  virtual absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions() = 0;
  // The versions that are kept beside the published ones.  Cost: one query.
  virtual absl::StatusOr<KeptVersions> ListKeptNumbers() = 0;

  // Jobs and children of jobs that are queued, running or waiting, in the order of submission, each
  // as it is when it is read. Without the lists of their requests: files, times of frames,
  // correspondences.
  virtual absl::StatusOr<std::vector<HeldJob>> ListUnfinishedJobs() = 0;

  // Reads everything in one snapshot. Damaged records are reported, not an error.
  virtual absl::StatusOr<CatalogInspection> Inspect() = 0;

  // Adds records of another catalog, all or none; their jobs are not leased.
  // Errors: kAlreadyExists if an animation, a family (or a deleted one of its name), a job or a
  // request_id is there already, naming it.
  virtual absl::Status Import(const CatalogContents& contents) = 0;
  // Checks that Import() would find the names free now.  Errors: as Import().
  virtual absl::Status CheckImport(const CatalogContents& contents) = 0;

  // The owners by name, without those who have nothing. The entry for data without an owner has an
  // empty name.
  virtual absl::StatusOr<std::vector<OwnerUse>> ListOwners() = 0;

  // Deletes the records of jobs that ended (in any state) longer ago than options.keep, by the
  // clock of the catalog. Returns their number. Their results stay, but their request ids are
  // forgotten.
  virtual absl::StatusOr<int64_t> PruneHistory(const PruneOptions& options) = 0;

  // Records whether the file of an animation can be read. With an error, a READY animation becomes
  // FAILED with this error, keeps its blob's id, and may be imported again. With OK, an animation
  // that failed this way is READY again. Nothing changes if the animation has another blob by now.
  virtual absl::Status SetAnimationReadable(const std::string& id, const std::string& blob,
                                            const absl::Status& readable) = 0;
};

}  // namespace liquidblend::store
