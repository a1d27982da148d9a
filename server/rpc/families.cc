#include <string>

#include "core/base/status_macros.h"
#include "server/rpc/api_messages.h"
#include "server/rpc/handlers.h"
#include "server/rpc/names.h"
#include "server/rpc/paging.h"

namespace liquidblend::rpc {

absl::StatusOr<v1::Family> GetFamily(Backends& backends, const v1::GetFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("name", request.name()));
  LB_ASSIGN_OR_RETURN(const store::pb::FamilyRecord record, backends.catalog.GetFamily(id));
  return ToFamily(record);
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

absl::StatusOr<Empty> DeleteFamily(Backends& backends, const v1::DeleteFamilyRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("name", request.name()));
  const absl::Status deleted = backends.catalog.DeleteFamily(id);
  if (deleted.ok() || absl::IsNotFound(deleted)) backends.families.Forget(id);
  LB_RETURN_IF_ERROR(deleted);
  return Empty();
}

}  // namespace liquidblend::rpc
