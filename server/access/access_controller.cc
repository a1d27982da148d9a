#include "server/access/access_controller.h"

#include "core/base/status_macros.h"

namespace liquidblend::server {

absl::Status AccessController::Admit(const Credentials& credentials, const AccessRequest& request,
                                     AccessGrant& grant) {
  LB_ASSIGN_OR_RETURN(grant.principal,
                      authorizer_.Check(BearerToken(credentials.authorization),
                                        credentials.certificate_subject, credentials.peer));
  LB_RETURN_IF_ERROR(quotas_.CountRequest(grant.principal));
  if (request.scope.has_value()) {
    LB_RETURN_IF_ERROR(CheckScope(grant.principal, *request.scope));
  }
  if (request.lasts) {
    LB_ASSIGN_OR_RETURN(grant.permit, quotas_.TakeStream(grant.principal));
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::server
