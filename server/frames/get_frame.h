// GetFrame without gRPC: finds the family, then orders the frame.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// Answer to GetFrame.
struct AnsweredFrame {
  FramePtr bytes;
  std::string generation;  // of the frame's family, see LoadedFamily
};

// One call of GetFrame.  Threads: safe.
class FrameCall : public std::enable_shared_from_this<FrameCall> {
 public:
  using Done = absl::AnyInvocable<void(absl::StatusOr<AnsweredFrame>)>;

  // Starts a call. Calls `done` once, on any thread, perhaps before this returns.
  //   client  the account that is charged
  //   span    of the call; gets the stages of the frame
  // Errors: kInvalidArgument with the fields at fault, SetWeights', FindFamily's, FrameMaker's.
  static std::shared_ptr<FrameCall> Start(Backends& backends, const v1::GetFrameRequest& request,
                                          std::string client, Done done, trace::Span span = {});

  // Ends the call with kCancelled unless it is over; its work stops soon if no other call shares
  // it.
  void Cancel();

  // For Start() only.
  FrameCall(Backends& backends, std::string client, Done done, trace::Span span)
      : backends_(backends),
        client_(std::move(client)),
        span_(std::move(span)),
        done_(std::move(done)) {}

 private:
  void Look(const v1::GetFrameRequest& request);
  absl::Status Order(const v1::GetFrameRequest& request, catalog::FamilyPtr loaded);
  void Finish(absl::StatusOr<AnsweredFrame> result);

  Backends& backends_;
  const std::string client_;
  const trace::Span span_;
  absl::Mutex mutex_;
  Done done_ ABSL_GUARDED_BY(mutex_);  // null: the call is over
  FrameMaker::Ticket ticket_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::server
