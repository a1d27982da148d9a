// Frames of an export, in the order of their times.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/cli/export/blend_curve.h"
#include "liquidblend/client.h"

namespace liquidblend::cli {

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  // The next frame; std::nullopt after the last one.  Errors: the server's, kDataLoss if it sends
  // more frames than there are, kDeadlineExceeded if it sends none for a while.
  virtual absl::StatusOr<std::optional<Frame>> Next() = 0;
};

// Times of the frames: each 1 / frames_per_second from 0 to duration_s. Any numbers are safe, as
// they may be a server's.
struct FrameClock {
  double frames_per_second = 0.0;  // > 0
  double duration_s = 0.0;         // >= 0
};

inline constexpr int64_t kMaxExportedFrames = 1'000'000;

// All frames of a family. Those of a constant blend are streamed; along a curve, each is requested
// with the blend of its time.
//   settings  what the frames are like; frames_per_second is that of `clock`, or not set if it is
//             the family's
//   patience  with a server that sends no whole frame: its largest may take long to make and send
// `client` outlives the source.
// Errors: kInvalidArgument if there are more than kMaxExportedFrames, or numbers of `clock` are out
// of range.
absl::StatusOr<std::unique_ptr<FrameSource>> OpenFrames(
    Client& client, const StreamSettings& settings, const BlendCurve& curve,
    const FrameClock& clock, absl::Duration patience = absl::Minutes(30));

}  // namespace liquidblend::cli
