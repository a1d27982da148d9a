// State of a stream of frames that may go on at another server: what was asked for, and how far it
// has come.
#pragma once

#include <cstdint>

#include "liquidblend/frame_stream.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::client {

// A stream is a sequence of calls of StreamFrames. Each one begins with all that was asked for so
// far, where the one before has stopped: at the same version, with the frame after the last one
// that has come. Frames are numbered through all calls. Threads: one at a time.
class StreamState {
 public:
  explicit StreamState(v1::StreamFramesRequest first) : settings_(std::move(first)) {}

  // Begins a call: returns its first message.
  v1::StreamFramesRequest Begin();
  // Notes a further message of the present call.
  void Change(const v1::StreamFramesRequest& change);
  // Takes a message of the server.
  StreamedFrame Take(v1::StreamFramesResponse&& response);

  // Whether the next call would go on with the next frame. Not after frames of a server that is too
  // old to say which that is.
  bool CanGoOn() const { return next_index_ == 0 || is_next_known_; }
  // Whether the last frame of the animation has come.
  bool IsComplete() const { return is_complete_; }
  // To be called if the version of the frames so far is not kept any more. False: that is an error,
  // as the version was asked for, or newer ones are allowed already.
  bool AllowNewerVersion();

  const std::string& family() const { return settings_.family(); }

 private:
  bool MayPinVersion() const;

  v1::StreamFramesRequest settings_;  // all messages so far, and the time of the next frame
  int64_t version_ = 0;               // of the last frame, if it is of the present family
  bool allows_newer_ = false;
  bool is_next_known_ = false;
  bool is_complete_ = false;
  int64_t next_index_ = 0;   // of the next frame
  int64_t num_dropped_ = 0;  // until the last frame

  // The present call.
  int64_t num_requests_ = 0;
  int64_t num_until_time_ = 0;    // messages until the last one with a time
  int64_t num_until_family_ = 0;  // messages until the last one with a family
  int64_t first_index_ = 0;
  int64_t first_dropped_ = 0;
};

}  // namespace liquidblend::client
