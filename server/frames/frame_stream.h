// State of one StreamFrames call: the values that the client has set so far, and the frames that
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

// Merges `newer` into `request`: values that it sets replace the earlier ones. Weights, parameters
// and surface are replaced as a whole, the encoding field by field, but bits and step together;
// credits add up.
// Unknown fields are dropped, so `request` never gets larger than the largest message.
void MergeRequest(const v1::StreamFramesRequest& newer, v1::StreamFramesRequest& request);

// One frame of a stream, to be sent.
struct StreamedFrame {
  FramePtr frame;
  int64_t frame_index = 0;  // counts sent frames from 0
  int64_t num_dropped = 0;  // skipped so far
  int level_of_detail = 0;
  std::optional<double> next_time_s;  // of the frame that follows; nothing after the last one
  int64_t num_requests = 0;           // messages of the client that it takes into account
};

// The first bytes of a serialised StreamFramesResponse; the bytes of `frame` follow them.
std::string ResponsePrefix(const StreamedFrame& streamed);

// The requested version, of the request's family or the stream's.
catalog::AskedVersion VersionOf(const v1::StreamFramesRequest& request);

// State of one stream: its family, the values of its requests, and its pace. Threads: one at a
// time.
class FrameStream {
 public:
  // The id of the family that has to be found before Change(); nothing if the stream keeps its own.
  // Errors: kInvalidArgument (family, version, min_version).
  absl::StatusOr<std::optional<std::string>> FamilyToFind(
      const v1::StreamFramesRequest& request) const;

  // Takes the values that `request` sets; the others stay.
  //   found  the family of FamilyToFind(), or null; it is kept until a request names a family or a
  //          version
  //   now    as for FramePacer
  // Errors: kInvalidArgument and kOutOfRange with the fields at fault, SetWeights'; the stream is
  // over then.
  absl::Status Change(const v1::StreamFramesRequest& request, catalog::FamilyPtr found,
                      absl::Duration now);

  // Whether the stream has a family.
  bool has_begun() const { return loaded_ != nullptr; }
  bool is_paced() const { return !values_.lossless(); }

  // The next frame's place on the clock and in the animation; nothing at the end of the animation.
  // Requires: has_begun(), as for all that follow.
  std::optional<FramePacer::Tick> Next(absl::Duration now) { return pacer_.Next(now); }

  // Whether the client wants one more frame now.
  bool has_credit() const { return !credit_left_.has_value() || *credit_left_ > 0; }

  // The family of the stream.
  const catalog::FamilyPtr& loaded() const { return loaded_; }
  // The query of this tick's frame, with the present values.
  FrameQuery QueryAt(const FramePacer::Tick& tick) const;
  absl::Duration period() const;  // between two frames; of a lossless stream, of the animation
  int64_t num_skipped() const { return pacer_.num_skipped(); }

  // Advances the stream: `frame`, made from `query`, is sent. Requires: Next() returned its tick
  // last.
  StreamedFrame Sent(const FrameQuery& query, FramePtr frame);

  // Records that a frame has been written, in the time `took`.
  void OnWritten(absl::Duration took, absl::Duration now);

 private:
  double DefaultFramesPerSecond(const v1::StreamFramesRequest& values) const;
  Pace PaceOf(const v1::StreamFramesRequest& values) const;
  int max_coarser() const;
  absl::Status TakeCredit(const v1::StreamFramesRequest& request);

  v1::StreamFramesRequest values_;  // all requests so far; without time_s
  catalog::FamilyPtr loaded_;
  FrameQuery query_;
  FramePacer pacer_;
  LevelChooser level_chooser_;
  std::optional<int64_t> credit_left_;  // frames; none: the client gives no credit
  int64_t num_sent_ = 0;
};

}  // namespace liquidblend::server
