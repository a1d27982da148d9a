// Interface of a stream to the server around it: clock, executor, families, frames.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
#include "server/catalog/families.h"
#include "server/frames/backends.h"
#include "server/frames/frame_maker.h"

namespace liquidblend::server {

// Host of a stream. The server implements it over its Backends, tests with a clock and threads that
// they control. Threads: safe.
class StreamHost {
 public:
  using Task = absl::AnyInvocable<void()>;
  // Identifies an order for a frame.
  using Ticket = std::shared_ptr<void>;
  // Identifies a task that waits for its time; null: none.
  using Timer = std::shared_ptr<void>;

  virtual ~StreamHost() = default;

  // A clock that only goes forward.
  virtual absl::Duration Now() const = 0;
  // Run the task soon, or after the delay, on another thread or after this has returned. Both drop
  // the task once the server has stopped.
  virtual void Post(Task task) = 0;
  virtual Timer StartTimer(absl::Duration delay, Task task) = 0;
  // Drops the task unless its time has come already.
  virtual void Cancel(const Timer& timer) = 0;

  // Finds a family; see server::FindFamily().
  virtual void FindFamily(const std::string& id, catalog::AskedVersion asked,
                          catalog::Families::Done done) = 0;
  // Order a frame, and cancel the order; see FrameMaker::Make() and FrameMaker::Leave().
  virtual Ticket Make(FrameOrder order, FrameMaker::Done done) = 0;
  virtual void Leave(const Ticket& ticket) = 0;

  // Takes memory for a frame that is sent; see UnreadAnswers::Hold().
  virtual absl::StatusOr<FramePtr> Hold(FramePtr frame,
                                        const std::shared_ptr<UnreadAnswers::Reader>& reader) = 0;

  virtual int64_t max_stream_bytes() const = 0;  // Limits::max_stream_bytes
  // Counts frames that the stream has skipped.
  virtual void CountDroppedFrames(const std::string& family, int64_t count) = 0;
};

// Makes the server's host of one stream, which counts as open while this lives.
// Requires: the backends outlive it.
std::shared_ptr<StreamHost> MakeStreamHost(Backends& backends);

}  // namespace liquidblend::server
