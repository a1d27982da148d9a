#include <string>
#include <vector>

#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/api/handlers.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/base/paging.h"
#include "server/frames/family_version.h"

namespace liquidblend::server {
namespace {

absl::StatusOr<v1::Family> WithKeptVersions(Backends& backends,
                                            const store::pb::FamilyRecord& record) {
  v1::Family family = ToFamily(record);
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
  LB_RETURN_IF_ERROR(deleted);
  return Empty();
}

}  // namespace liquidblend::server
