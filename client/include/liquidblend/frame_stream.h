// Stream of frames from the server, while weights, time and rate change.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "liquidblend/frame.h"

namespace liquidblend {

// Settings of a stream. A field that is not set, or empty, keeps its value; at the start of a
// stream it has its default.
struct StreamSettings {
  std::string family;                       // the id; required at the start
  std::vector<double> weights;              // one per target; default all 0
  Parameters parameters;                    // replaces weights; weights replace it
  std::optional<bool> extrapolate;          // as FrameRequest's; default false
  std::optional<double> time_s;             // time to continue from; default 0
  std::optional<double> rate;               // seconds of animation per second; default 1; 0 holds
  std::optional<double> frames_per_second;  // of the clock; (0, 240]; default the family's
  int position_bits = 0;                    // 8 to 20; 0: as before; default the server's
  double position_step_m = 0.0;             // as FrameRequest's; bits and step replace one another
  std::optional<EncodingPreset> encoding;   // default kFastest
  std::optional<FrameFormat> format;        // default kDraco
  std::optional<bool> loop;                 // start again at the end; default: end the stream
  std::optional<bool> lossless;  // the whole animation one by one, nothing skipped; default false
  std::optional<SurfaceOptions> surface;  // default: the slice itself
  // Whether frames may be coarser than surface.level_of_detail while the connection is too slow;
  // ignored for lossless streams. Default false.
  std::optional<bool> adapt_level_of_detail;
  // Minimum version, as in FrameRequest, of `family`, or without one of the stream's present
  // family. That keeps its version until this one is loaded.
  int64_t min_version = 0;
  // The exact version, likewise; it replaces min_version. 0: any.
  int64_t version = 0;
};

struct StreamedFrame {
  Frame frame;
  int64_t frame_index = 0;  // counts sent frames from 0, of all servers of the stream
  int64_t num_dropped = 0;  // frames skipped so far because they would have been late
  int level_of_detail = 0;  // of this frame
};

// One running stream; made by Client::StreamFrames. The destructor cancels it. If its server stops
// or cannot be reached any more, it goes on at another one: with the next frame, of the same
// version of the family, or of a newer one if that is not kept any more. Not if the server is too
// old to tell which the next frame is. Threads: Read from one thread; Change and Cancel from any.
class FrameStream {
 public:
  ~FrameStream();
  FrameStream(const FrameStream&) = delete;
  FrameStream& operator=(const FrameStream&) = delete;

  // Waits for the next frame; std::nullopt after the last one.
  //   timeout  of a server that is reached but sends no frame; then the stream has ended. Not for
  //            streams with rate 0, which send none while nothing changes.
  // Errors: the server's, kCancelled after Cancel, kDeadlineExceeded after the timeout,
  // kUnavailable if no server can be reached within RetryOptions.
  absl::StatusOr<std::optional<StreamedFrame>> Read(
      absl::Duration timeout = absl::InfiniteDuration());

  // Sets values from the next frame on.  Errors: kFailedPrecondition if the stream ended.
  absl::Status Change(const StreamSettings& settings);

  // Ends the stream at once; a Read that waits returns.
  void Cancel();

 private:
  friend class Client;
  class Impl;
  explicit FrameStream(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace liquidblend
