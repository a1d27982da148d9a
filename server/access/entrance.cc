#include "server/access/entrance.h"

#include "core/base/status_macros.h"

namespace liquidblend::server {

absl::Status Entrance::Enter(const Visitor& visitor, const Errand& errand, Admitted& admitted) {
  LB_ASSIGN_OR_RETURN(admitted.principal,
                      authorizer_.Check(BearerToken(visitor.authorization),
                                        visitor.certificate_subject, visitor.peer));
  LB_RETURN_IF_ERROR(quotas_.CountRequest(admitted.principal));
  if (errand.scope.has_value()) {
    LB_RETURN_IF_ERROR(CheckScope(admitted.principal, *errand.scope));
  }
  if (errand.lasts) {
    LB_ASSIGN_OR_RETURN(admitted.permit, quotas_.TakeStream(admitted.principal));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::server
