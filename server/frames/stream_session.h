// Session of one StreamFrames call, without its wire: decides which frames are made and sent, and
// when. Knows no gRPC.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/frames/backends.h"
#include "server/frames/frame_stream.h"
#include "server/frames/stream_host.h"

namespace liquidblend::server {

// Session of a stream. Events are only recorded. Steps on the host's executor, one at a time,
// handle them: they find a family, order the frame that is due, send it, and set the timer. While
// the client consumes a frame, the next one is made ahead, once as many changes have come since
// that frame as came before it. So frames of steady values begin at once, and the session waits for
// a client that sets weights once a frame. Threads: safe. All calls return at once.
class StreamSession : public std::enable_shared_from_this<StreamSession> {
 public:
  // Connection to the client. Calls come one at a time, none after End(); but GiveUp() at any time.
  class Sink : public UnreadAnswers::Reader {
   public:
    // Sends a frame. OnWritten() follows when the connection has taken it; no other frame is sent
    // before.
    virtual void Send(const StreamedFrame& streamed) = 0;
    virtual void End(const absl::Status& status) = 0;
  };

  // Starts a session. It must be owned by a shared_ptr, as a rule the sink's.
  //   client  the account that is charged for frames
  //   span    of the stream; gets the stages of the first frame, and counts of all
  StreamSession(Backends& backends, std::string client, std::weak_ptr<Sink> sink,
                trace::Span span = {})
      : StreamSession(MakeStreamHost(backends), std::move(client), std::move(sink),
                      std::move(span)) {}
  StreamSession(std::shared_ptr<StreamHost> host, std::string client, std::weak_ptr<Sink> sink,
                trace::Span span = {})
      : host_(std::move(host)),
        client_(std::move(client)),
        sink_(std::move(sink)),
        span_(std::move(span)) {}

  // Handles a request of the client.
  void OnRequest(const v1::StreamFramesRequest& request);
  void OnHalfClosed();  // no more requests will come; frames go on
  // Records that the connection has taken the frame.
  void OnWritten();
  void Stop();  // the client has gone, or the sink: no frame is wanted any more

 private:
  // Events since the last step.
  struct Notes {
    std::optional<v1::StreamFramesRequest> newest;
    int64_t num_newest = 0;  // of messages in it
    std::optional<absl::StatusOr<catalog::FamilyPtr>> found;
    std::optional<absl::StatusOr<FramePtr>> made;
    int64_t made_number = 0;  // of the order that it belongs to
    std::optional<absl::Duration> written_at;
    bool is_half_closed = false;
    bool is_stopped = false;
  };

  // A frame that is being made, or made ahead.
  struct Order {
    int64_t number = 0;
    FrameKey key;
    FrameQuery query;
    StreamHost::Ticket ticket;
    FramePtr frame;             // when it is made
    bool is_committed = false;  // its turn has come: it is sent, even if values change
  };

  template <typename Note>
  void Leave(Note&& note);
  void WantStep() ABSL_LOCKS_EXCLUDED(mutex_);
  void TakeSteps();
  bool BeginStep();

  absl::Status Step();
  void TakeWritten();
  absl::Status TakeMade();
  absl::Status TakeValues();
  absl::Status Change(const v1::StreamFramesRequest& request, catalog::FamilyPtr found);
  absl::Status GoOn(absl::Duration now);
  bool WillStayWithoutCredit() const;
  bool MayMakeAhead() const;
  void StartOrder(const FramePacer::Tick& tick, absl::Duration now);
  void DropOrder();
  absl::Status SendOrder(absl::Duration now);
  void Describe(const StreamedFrame& streamed, int64_t num_dropped) const;
  void WakeAt(absl::Duration due, absl::Duration now);
  void CancelAlarm();
  void End(const absl::Status& status);

  const std::shared_ptr<StreamHost> host_;
  const std::string client_;
  const std::weak_ptr<Sink> sink_;
  const trace::Span span_;

  absl::Mutex mutex_;
  Notes inbox_ ABSL_GUARDED_BY(mutex_);
  bool is_step_wanted_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_stepping_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Duration alarm_ ABSL_GUARDED_BY(mutex_) = absl::InfiniteDuration();

  // State of the steps.
  StreamHost::Timer alarm_timer_;
  Notes notes_;
  FrameStream stream_;
  std::optional<v1::StreamFramesRequest> waiting_request_;  // its family is being found
  std::optional<Order> order_;
  int64_t num_orders_ = 0;
  bool is_writing_ = false;
  bool has_ended_ = false;
  int64_t num_taken_ = 0;    // messages of the client, of waiting_request_ too
  int64_t num_shown_ = 0;    // of these, whose values stream_ has
  int64_t num_changes_ = 0;  // since the last frame was sent
  // Between the last frame and the one before it, or the beginning; nothing if there was no frame,
  // or one was skipped.
  std::optional<int64_t> num_changes_before_;
  int64_t num_skipped_ = 0;  // when the last frame was sent
  int64_t last_bytes_ = 0;   // of that frame
  absl::Duration write_began_;
};

}  // namespace liquidblend::server
