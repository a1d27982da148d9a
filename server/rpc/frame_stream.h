// What one StreamFrames call shows: the values that the client has set so far, and the frames that
// follow from them. Knows no gRPC and no clock.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/rpc/backends.h"
#include "server/rpc/frame_pacer.h"

namespace liquidblend::rpc {

// What `newer` sets replaces what `request` had: weights or parameters and surface as a whole, of
// the encoding each field.
void MergeRequest(const v1::StreamFramesRequest& newer, v1::StreamFramesRequest& request);

// Threads: one at a time. May block while a family is loaded.
class FrameStream {
 public:
  explicit FrameStream(Backends& backends) : backends_(backends) {}

  // Takes the values that `request` sets; the others stay. A family that is named is taken in its
  // latest version, which stays until one is named again.
  // now: as for FramePacer.  Errors: kInvalidArgument and kOutOfRange with the fields at fault, and
  // those of Families::Get(); the stream is over then.
  absl::Status Change(const v1::StreamFramesRequest& request, absl::Duration now);

  bool has_begun() const { return loaded_ != nullptr; }

  // The next frame's place on the clock and in the animation; nothing at the end of the animation.
  // Requires: has_begun().
  std::optional<FramePacer::Tick> Next(absl::Duration now) { return pacer_.Next(now); }

  // Makes that frame and moves on. Requires: Next() returned `tick`.
  absl::StatusOr<v1::StreamFramesResponse> Make(const FramePacer::Tick& tick);

 private:
  Pace PaceOf(const v1::StreamFramesRequest& values) const;

  Backends& backends_;
  v1::StreamFramesRequest values_;  // all requests so far; without time_s
  std::shared_ptr<const catalog::LoadedFamily> loaded_;
  FrameQuery query_;
  FramePacer pacer_;
  int64_t num_made_ = 0;
};

}  // namespace liquidblend::rpc
