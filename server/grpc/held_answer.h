// Answers of gRPC's calls in the budget of unread answers.
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "server/frames/backends.h"
#include "server/grpc/admission.h"

namespace liquidblend::server {

// Bytes of an answer that are not counted, so that small ones are never refused: that to a
// registration tells of a job that is accepted.
inline constexpr int64_t kUncountedBytes = 4096;

// Returns the answer's bytes, which count until gRPC has written them or the call ends. Errors:
// those of UnreadAnswers::Hold().  Requires: the call's reactor calls Admission::OnDone().
absl::StatusOr<grpc::ByteBuffer> HoldAnswer(Backends& backends,
                                            const std::shared_ptr<Admission>& admission,
                                            AnswerPtr bytes);

}  // namespace liquidblend::server
