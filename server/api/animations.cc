#include <string>

#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/api/handlers.h"
#include "server/base/names.h"
#include "server/base/paging.h"

namespace liquidblend::server {

absl::StatusOr<v1::Animation> GetAnimation(Backends& backends,
                                           const v1::GetAnimationRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("name", request.name()));
  LB_ASSIGN_OR_RETURN(const store::pb::AnimationRecord record, backends.catalog.GetAnimation(id));
  return ToAnimation(record);
}

absl::StatusOr<v1::ListAnimationsResponse> ListAnimations(
    Backends& backends, const v1::ListAnimationsRequest& request) {
  LB_RETURN_IF_ERROR(CheckPageSize(request.page_size()));
  const auto found = backends.catalog.ListAnimations(request.page_size(), request.page_token());
  LB_RETURN_IF_ERROR(FromList(found.status()));
  v1::ListAnimationsResponse response;
  for (const auto& record : found->records) *response.add_animations() = ToAnimation(record);
  response.set_next_page_token(found->next_page_token);
  return response;
}

absl::StatusOr<Empty> DeleteAnimation(Backends& backends,
                                      const v1::DeleteAnimationRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("name", request.name()));
  LB_RETURN_IF_ERROR(backends.catalog.DeleteAnimation(id));
  return Empty();
}

}  // namespace liquidblend::server
