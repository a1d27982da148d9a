// Records of the catalog <-> messages of the public API.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "google/longrunning/operations.pb.h"
#include "liquidblend/store/v1/records.pb.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::server {

v1::Animation ToAnimation(const store::pb::AnimationRecord& record);
v1::FamilyVersion ToFamilyVersion(const store::pb::FamilyRecord& record);
v1::Family ToFamily(const store::pb::FamilyRecord& record);
v1::ParameterSpace ToParameterSpace(const store::pb::ParameterSpace& record);
v1::TimeBlending ToTimeBlending(const store::pb::FamilyManifest& manifest);

// The workers that have asked for work lately, for the operations of one answer: asked for when the
// first of them wants to know, and once.  Threads: one at a time.
class WorkerList {
 public:
  explicit WorkerList(store::Catalog& catalog) : catalog_(catalog) {}
  // Errors: those of Catalog::ListWorkers().
  absl::StatusOr<const std::vector<store::pb::WorkerRecord>*> Get();

 private:
  store::Catalog& catalog_;
  std::optional<std::vector<store::pb::WorkerRecord>> workers_;
};

// The operation that a job is to clients. Its response is the animation or family as it is now, and
// no more than its name if it has been deleted since.
// Errors: those of the catalog, which is asked for the response.
absl::StatusOr<google::longrunning::Operation> ToOperation(const store::pb::JobRecord& record,
                                                           store::Catalog& catalog,
                                                           WorkerList& workers);
absl::StatusOr<google::longrunning::Operation> ToOperation(const store::pb::JobRecord& record,
                                                           store::Catalog& catalog);

store::pb::ImportOptions ToRecord(const v1::ImportOptions& options);
store::pb::RegistrationOptions ToRecord(const v1::RegistrationOptions& options);
store::pb::SpaceTimeOptions ToRecord(const v1::SpaceTimeOptions& options);
store::pb::ParameterSpace ToRecord(const v1::ParameterSpace& space);
store::pb::Correspondence ToRecord(const v1::Correspondence& correspondence);

}  // namespace liquidblend::server
