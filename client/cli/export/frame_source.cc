#include "client/cli/export/frame_source.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

// A time that lies this share of a frame after the end is still in the animation, as for streams.
constexpr double kEndTolerance = 1e-6;

// A stream may have so many frames more than are expected: the server's rounding is its own.
constexpr int64_t kFramesMore = 2;

std::string DescribeClock(const FrameClock& clock) {
  return absl::StrCat(clock.duration_s, " s at ", clock.frames_per_second, " frames per second");
}

// Not for NaN, infinity and negative numbers either.
absl::Status CheckClock(const FrameClock& clock) {
  const double num_frames = clock.duration_s * clock.frames_per_second;
  if (clock.duration_s >= 0.0 && clock.frames_per_second >= 0.0 &&
      num_frames < static_cast<double>(kMaxExportedFrames)) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat(DescribeClock(clock), " are not between 1 and ",
                                                 kMaxExportedFrames,
                                                 " frames, which are exported at most"));
}

// Ends a stream of a server that does not.
class StreamSource : public FrameSource {
 public:
  StreamSource(std::unique_ptr<FrameStream> stream, const FrameClock& clock,
               absl::Duration patience)
      : stream_(std::move(stream)),
        clock_(clock),
        patience_(patience),
        num_left_(kFramesMore +
                  static_cast<int64_t>(std::ceil(clock.duration_s * clock.frames_per_second))) {}

  absl::StatusOr<std::optional<Frame>> Next() override {
    LBC_ASSIGN_OR_RETURN(std::optional<StreamedFrame> streamed, stream_->Read(patience_));
    if (!streamed) return std::optional<Frame>();
    if (num_left_-- == 0) {
      return absl::DataLossError(
          absl::StrCat("the server sends more frames than there are in ", DescribeClock(clock_)));
    }
    return std::optional<Frame>(std::move(streamed->frame));
  }

 private:
  std::unique_ptr<FrameStream> stream_;
  const FrameClock clock_;
  const absl::Duration patience_;
  int64_t num_left_;
};

class CurveSource : public FrameSource {
 public:
  CurveSource(Client& client, const StreamSettings& settings, BlendCurve curve,
              const FrameClock& clock)
      : client_(client), curve_(std::move(curve)), clock_(clock) {
    request_.family = settings.family;
    request_.version = settings.version;
    request_.position_bits = settings.position_bits;
    request_.position_step_m = settings.position_step_m;
    request_.encoding = settings.encoding.value_or(EncodingPreset::kFastest);
    request_.surface = settings.surface.value_or(SurfaceOptions());
  }

  absl::StatusOr<std::optional<Frame>> Next() override {
    const auto number = static_cast<double>(next_);
    const double last = clock_.duration_s * clock_.frames_per_second + kEndTolerance;
    if (number > last) return std::optional<Frame>();
    ++next_;
    request_.time_s = std::min(number / clock_.frames_per_second, clock_.duration_s);
    const Blend blend = curve_.At(request_.time_s);
    request_.weights = blend.weights;
    request_.parameters = blend.parameters;
    request_.extrapolate = blend.extrapolate;
    LBC_ASSIGN_OR_RETURN(Frame frame, client_.GetFrame(request_));
    return std::optional<Frame>(std::move(frame));
  }

 private:
  Client& client_;
  const BlendCurve curve_;
  const FrameClock clock_;
  FrameRequest request_;
  int64_t next_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameSource>> OpenFrames(Client& client,
                                                        const StreamSettings& settings,
                                                        const BlendCurve& curve,
                                                        const FrameClock& clock,
                                                        absl::Duration patience) {
  LBC_RETURN_IF_ERROR(CheckClock(clock));
  if (!curve.is_constant()) {
    return std::make_unique<CurveSource>(client, settings, curve, clock);
  }
  StreamSettings constant = settings;
  const Blend blend = curve.At(0.0);
  constant.weights = blend.weights;
  constant.parameters = blend.parameters;
  constant.extrapolate = blend.extrapolate;
  constant.time_s = 0.0;
  constant.loop = false;
  constant.lossless = true;
  LBC_ASSIGN_OR_RETURN(std::unique_ptr<FrameStream> stream, client.StreamFrames(constant));
  return std::make_unique<StreamSource>(std::move(stream), clock, patience);
}

}  // namespace liquidblend::cli
