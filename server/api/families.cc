#include <string>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/parameters/triangulation.h"
#include "core/store/files/parameter_records.h"
#include "server/api/api_messages.h"
#include "server/api/handlers.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/base/paging.h"
#include "server/frames/family_version.h"

namespace liquidblend::server {
namespace {

// None, if a family of an older program has points that are refused now.
void AddSimplices(const store::pb::ParameterSpace& space, v1::Family& family) {
  if (!family.has_parameter_space()) return;
  const auto triangulation = parameters::Triangulation::Make(store::FromMessage(space));
  if (!triangulation.ok()) return;
  for (const std::vector<int>& simplex : triangulation->simplices()) {
    family.mutable_parameter_space()->add_simplices()->mutable_animations()->Assign(simplex.begin(),
                                                                                    simplex.end());
  }
}

absl::StatusOr<v1::Family> WithKeptVersions(Backends& backends,
                                            const store::pb::FamilyRecord& record) {
  v1::Family family = ToFamily(record);
  AddSimplices(record.manifest().parameter_space(), family);
  LB_ASSIGN_OR_RETURN(const std::vector<store::pb::FamilyRecord> kept,
                      backends.catalog.ListKeptVersions(record.id()));
  for (const store::pb::FamilyRecord& version : kept) {
    *family.add_kept_versions() = ToFamilyVersion(version);
  }
  return family;
}

}  // namespace

absl::StatusOr<v1::Family> GetFamily(Backends& backends, const v1::GetFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("name", request.name()));
  LB_ASSIGN_OR_RETURN(const store::pb::FamilyRecord record,
                      FindFamilyVersion(backends.catalog, id, request.version()));
  return WithKeptVersions(backends, record);
}

absl::StatusOr<v1::ListFamiliesResponse> ListFamilies(Backends& backends,
                                                      const v1::ListFamiliesRequest& request) {
  LB_RETURN_IF_ERROR(CheckPageSize(request.page_size()));
  const auto found = backends.catalog.ListFamilies(request.page_size(), request.page_token());
  LB_RETURN_IF_ERROR(FromList(found.status()));
  v1::ListFamiliesResponse response;
  for (const auto& record : found->records) *response.add_families() = ToFamily(record);
  response.set_next_page_token(found->next_page_token);
  return response;
}

// Nothing older than the new version is served afterwards: it is loaded for the next call.
absl::StatusOr<v1::Family> RollbackFamily(Backends& backends,
                                          const v1::RollbackFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("name", request.name()));
  if (request.version() < 1) return InvalidField("version", "must be at least 1");
  LB_ASSIGN_OR_RETURN(
      const store::pb::FamilyRecord record,
      backends.catalog.RollbackFamily(id, request.version(), backends.limits.keep_versions));
  backends.families.Forget(id, record.version());
  return WithKeptVersions(backends, record);
}

absl::StatusOr<Empty> DeleteFamily(Backends& backends, const v1::DeleteFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("name", request.name()));
  const absl::Status deleted = backends.catalog.DeleteFamily(id);
  if (deleted.ok() || absl::IsNotFound(deleted)) backends.families.Forget(id);
  backends.open_blobs.Clear();
  LB_RETURN_IF_ERROR(deleted);
  return Empty();
}

}  // namespace liquidblend::server
