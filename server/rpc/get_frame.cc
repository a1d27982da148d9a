#include <memory>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/rpc/errors.h"
#include "server/rpc/handlers.h"
#include "server/rpc/names.h"
#include "server/rpc/query_weights.h"

namespace liquidblend::rpc {

absl::StatusOr<v1::Frame> GetFrame(Backends& backends, const v1::GetFrameRequest& request) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("family", request.family()));
  if (request.version() < 0) return InvalidField("version", "must not be negative");
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const catalog::LoadedFamily> loaded,
                      backends.families.Get(id, request.version()));
  FrameQuery query;
  const AskedBlend blend = {request.weights(), request.parameters(), request.extrapolate()};
  LB_RETURN_IF_ERROR(SetWeights(*loaded, blend, query));
  query.time_s = request.time_s();
  query.encoding = request.encoding();
  query.surface = request.surface();
  std::unique_ptr<FrameBuffers> buffers = backends.buffers.Take();
  absl::StatusOr<v1::Frame> frame = MakeFrame(*loaded, query, *buffers);
  backends.buffers.GiveBack(std::move(buffers));
  return frame;
}

}  // namespace liquidblend::rpc
