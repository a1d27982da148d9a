// Budget of memory for frames that clients have not read yet.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "server/frames/frame_cache.h"

namespace liquidblend::server {

// Options of UnreadFrames.
struct UnreadFramesOptions {
  int64_t max_bytes = int64_t{256} << 20;       // >= 1; a single frame may be larger
  absl::Duration patience = absl::Seconds(30);  // >= 0; with a reader, while memory is short
};

// Budget of the frames that are on their way to clients over gRPC and WebSockets. Without it, a
// client that asks for frames and never reads them would keep each in memory for as long as its
// connection lasts. (HTTP's other answers have a budget of their own, and end after a while.)
// A frame that goes to several readers, or that the cache has, counts once. If the budget is used
// up, accounts that hold less than an equal part of it still get frames; so all frames together may
// take twice the budget. Readers that have kept a frame longer than the patience are ended while
// more than half of the budget is taken, the oldest first.
// Threads: safe.
class UnreadFrames {
 public:
  // The call or connection that a frame is sent over.
  class Reader {
   public:
    virtual ~Reader() = default;
    // Ends it, so that its frame is let go. Returns at once; called by any thread, perhaps twice.
    virtual void GiveUp() = 0;
  };

  explicit UnreadFrames(const UnreadFramesOptions& options = {})
      : state_(std::make_shared<State>(options)) {}

  // Returns the same frame, which counts until the last copy of the result is destroyed.
  //   client  as FrameOrder::client; connections of one host share an account
  //   now     on a clock that only goes forward
  // Errors: kUnavailable with google.rpc.RetryInfo and the reason TOO_MANY_ANSWERS.
  absl::StatusOr<FramePtr> Hold(const std::string& client, FramePtr frame,
                                std::weak_ptr<Reader> reader, absl::Duration now);

  int64_t num_bytes() const;  // that are held now

 private:
  // A frame that a reader has not read yet.
  struct Held {
    std::string account;
    FramePtr frame;
    std::weak_ptr<Reader> reader;
    absl::Duration since;
  };
  using HeldList = std::list<Held>;

  // Outlives this while frames are held.
  struct State {
    explicit State(const UnreadFramesOptions& of) : options(of) {}
    bool HasRoomFor(const std::string& account, const FramePtr& frame) const
        ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
    HeldList::iterator Add(Held held) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);
    void LetGo(HeldList::iterator held) ABSL_LOCKS_EXCLUDED(mutex);
    std::vector<std::weak_ptr<Reader>> FindStalled(absl::Duration now) const
        ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex);

    const UnreadFramesOptions options;
    mutable absl::Mutex mutex;
    HeldList held ABSL_GUARDED_BY(mutex);  // the oldest first
    std::map<std::string, int64_t> bytes_of_account ABSL_GUARDED_BY(mutex);
    std::map<const std::string*, int> num_readers ABSL_GUARDED_BY(mutex);  // by frame
    int64_t num_bytes ABSL_GUARDED_BY(mutex) = 0;  // of all frames, each once
  };

  const std::shared_ptr<State> state_;
};

}  // namespace liquidblend::server
