// What one StreamFrames call shows: the values that the client has set so far, and the frames that
// follow from them. Knows no gRPC and no clock.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/catalog/families.h"
#include "server/frames/frame_cache.h"
#include "server/frames/frame_pacer.h"
#include "server/frames/level_chooser.h"
#include "server/frames/make_frame.h"

namespace liquidblend::server {

// What `newer` sets replaces what `request` had: weights or parameters and surface as a whole, of
// the encoding each field, but bits and step as one. Unknown fields are dropped, so `request` never
// gets larger than the largest message.
void MergeRequest(const v1::StreamFramesRequest& newer, v1::StreamFramesRequest& request);

// One frame of a stream, on its way to the client.
struct StreamedFrame {
  FramePtr frame;
  int64_t frame_index = 0;  // counts sent frames from 0
  int64_t num_dropped = 0;  // skipped so far
  int level_of_detail = 0;
};

// What a serialised StreamFramesResponse begins with; then follow the bytes of `frame`.
std::string ResponsePrefix(const StreamedFrame& streamed);

// The version that is asked for, of the request's family or the stream's.
catalog::AskedVersion VersionOf(const v1::StreamFramesRequest& request);

// Threads: one at a time.
class FrameStream {
 public:
  // The id of the family that has to be found before Change(); nothing: goes on with its own.
  // Errors: kInvalidArgument (family, version, min_version).
  absl::StatusOr<std::optional<std::string>> FamilyToFind(
      const v1::StreamFramesRequest& request) const;

  // Takes the values that `request` sets; the others stay.
  //   found  the version of the family that was to be found, or nothing; it stays until a family or
  //          a version is named again
  //   now    as for FramePacer
  // Errors: kInvalidArgument and kOutOfRange with the fields at fault, SetWeights'; the stream is
  // over then.
  absl::Status Change(const v1::StreamFramesRequest& request, catalog::FamilyPtr found,
                      absl::Duration now);

  bool has_begun() const { return loaded_ != nullptr; }
  bool is_paced() const { return !values_.lossless(); }

  // The next frame's place on the clock and in the animation; nothing at the end of the animation.
  // Requires: has_begun(), as for all that follow.
  std::optional<FramePacer::Tick> Next(absl::Duration now) { return pacer_.Next(now); }

  const catalog::FamilyPtr& loaded() const { return loaded_; }
  // What shows this tick, with the values of now.
  FrameQuery QueryAt(const FramePacer::Tick& tick) const;
  absl::Duration period() const;  // between two frames; of a lossless stream, of the animation
  int64_t num_skipped() const { return pacer_.num_skipped(); }

  // Moves on: `frame`, made of `query`, goes out. Requires: Next() returned its tick last.
  StreamedFrame Sent(const FrameQuery& query, FramePtr frame);

  // It has been written, which took this long.
  void OnWritten(absl::Duration took, absl::Duration now);

 private:
  double DefaultFramesPerSecond(const v1::StreamFramesRequest& values) const;
  Pace PaceOf(const v1::StreamFramesRequest& values) const;
  int max_coarser() const;

  v1::StreamFramesRequest values_;  // all requests so far; without time_s
  catalog::FamilyPtr loaded_;
  FrameQuery query_;
  FramePacer pacer_;
  LevelChooser level_chooser_;
  int64_t num_sent_ = 0;
};

}  // namespace liquidblend::server
