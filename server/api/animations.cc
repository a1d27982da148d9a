#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/api/handlers.h"
#include "server/base/names.h"
#include "server/base/paging.h"
#include "server/frames/animation_frame.h"

namespace liquidblend::server {

absl::StatusOr<v1::Animation> GetAnimation(Backends& backends,
                                           const v1::GetAnimationRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("name", request.name()));
  LB_ASSIGN_OR_RETURN(const store::pb::AnimationRecord record, backends.catalog.GetAnimation(id));
  return ToAnimation(record);
}

absl::StatusOr<v1::AnimationFrame> GetAnimationFrame(Backends& backends,
                                                     const v1::GetAnimationFrameRequest& request,
                                                     const Caller& caller) {
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("animation", request.animation()));
  LB_ASSIGN_OR_RETURN(const store::pb::AnimationRecord record, backends.catalog.GetAnimation(id));
  if (record.state() != store::pb::AnimationRecord::READY) {
    return absl::FailedPreconditionError(
        absl::StrCat(AnimationName(id), " has no frames: its import has not succeeded"));
  }
  LB_ASSIGN_OR_RETURN(const int k, FindAnimationFrame(record.manifest(), request));
  LB_RETURN_IF_ERROR(CheckAnimationFrame(record.manifest(), request));
  LB_ASSIGN_OR_RETURN(const AnimationFramesPtr frames,
                      backends.animations.Open(record.blob(), AnimationName(id)));
  LB_ASSIGN_OR_RETURN(mesh::TriangleMesh mesh, frames->Read(k));
  v1::AnimationFrame frame;
  const int64_t cost = CostOfAnimationFrame(mesh);
  LB_RETURN_IF_ERROR(backends.frames.RunInTurn(caller.principal.key, cost, [&]() -> absl::Status {
    LB_ASSIGN_OR_RETURN(frame,
                        EncodeAnimationFrame(frames->manifest(), k, std::move(mesh), request));
    return absl::OkStatus();
  }));
  frame.set_animation(AnimationName(id));
  return frame;
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
  backends.animations.Clear();
  backends.open_blobs.Clear();
  return Empty();
}

}  // namespace liquidblend::server
