#include "server/grpc/held_answer.h"

#include <iterator>
#include <utility>

#include "core/base/status_macros.h"
#include "server/base/work_pool.h"
#include "server/grpc/byte_buffers.h"

namespace liquidblend::server {

absl::StatusOr<grpc::ByteBuffer> HoldAnswer(Backends& backends,
                                            const std::shared_ptr<Admission>& admission,
                                            AnswerPtr bytes) {
  if (std::ssize(*bytes) <= kUncountedBytes) return ToByteBuffer(bytes);
  LB_ASSIGN_OR_RETURN(const AnswerPtr held,
                      backends.unread.Hold(std::move(bytes), admission, SteadyNow()));
  return ToByteBuffer(held);
}

}  // namespace liquidblend::server
