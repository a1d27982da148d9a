// What keeping a catalog takes, beside the work that goes through it: looking at all of it, moving
// it to another place, telling who works on what.
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
  std::vector<pb::JobRecord> jobs;          // and parts of jobs
};

struct CatalogInspection {
  CatalogContents contents;         // without what cannot be read
  std::vector<std::string> blobs;   // as Catalog::ListReferencedBlobs()
  std::vector<std::string> damage;  // records that cannot be read or contradict others, by name
};

// By family, the numbers of the versions that are kept beside the published one.
using KeptVersions = std::map<std::string, std::set<int64_t>>;

struct HeldJob {
  pb::JobRecord job;
  absl::Time lease_expires = absl::InfinitePast();  // of one that is RUNNING
};

// What an owner (a principal's name) has.
struct OwnerUse {
  std::string owner;
  // The files of animations and families, each once, and what animations are being imported from.
  int64_t stored_bytes = 0;
  int64_t num_queued_jobs = 0;  // accepted, and not done; parts do not count
  int64_t num_animations = 0;   // ListOwners() tells these
  int64_t num_families = 0;     // whose version is this owner's
};

struct PruneOptions {
  absl::Duration keep = absl::Hours(24 * 30);  // >= 0, after the end of a job; 0: for ever
  bool dry_run = false;                        // only count
  std::function<bool()> must_stop = {};        // asked now and then; empty: never
  absl::Status Validate() const;               // names the first field out of range, and its value
};

// A part of Catalog, whose errors and threads it shares.
class CatalogUpkeep {
 public:
  virtual ~CatalogUpkeep() = default;

  // The version of each family, 0 if it has none yet: what others published or deleted shows here.
  // Cost: one query; meant for every second.
  virtual absl::StatusOr<std::map<std::string, int64_t>> ListFamilyVersions() = 0;
  // The versions that are kept beside these.  Cost: one query.
  virtual absl::StatusOr<KeptVersions> ListKeptNumbers() = 0;

  // Jobs and parts of jobs that are queued, running or waiting, as they were submitted.
  virtual absl::StatusOr<std::vector<HeldJob>> ListUnfinishedJobs() = 0;

  // Reads everything, at one moment. Damage of records is no error.
  virtual absl::StatusOr<CatalogInspection> Inspect() = 0;

  // Adds records of another catalog, all or none; nobody holds a lease on their jobs.
  // Errors: kAlreadyExists if an animation, a family (or a deleted one of its name), a job or a
  // request_id is there already, naming it.
  virtual absl::Status Import(const CatalogContents& contents) = 0;
  // Whether Import() would find the names free now.  Errors: as Import().
  virtual absl::Status CheckImport(const CatalogContents& contents) = 0;

  // By name; those who have nothing are left out. The name of what is nobody's is empty.
  virtual absl::StatusOr<std::vector<OwnerUse>> ListOwners() = 0;

  // Deletes the records of jobs that ended (in whatever state) longer ago than that, by the clock
  // of the catalog, and returns how many. What they made stays, but their request ids are
  // forgotten.
  virtual absl::StatusOr<int64_t> PruneHistory(const PruneOptions& options) = 0;

  // Tells of an animation that is READY that its file cannot be read: it becomes FAILED with this
  // error, keeps its blob's id, and may be imported again. With OK, one of which that was told is
  // READY again. Nothing changes if the animation has another blob by now.
  virtual absl::Status SetAnimationReadable(const std::string& id, const std::string& blob,
                                            const absl::Status& readable) = 0;
};

}  // namespace liquidblend::store
