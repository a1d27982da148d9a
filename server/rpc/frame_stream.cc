#include "server/rpc/frame_stream.h"

#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/rpc/errors.h"
#include "server/rpc/names.h"
#include "server/rpc/query_weights.h"

namespace liquidblend::rpc {
namespace {

constexpr double kMaxFramesPerSecond = 240.0;
constexpr double kMaxRate = 1000.0;

bool SetsPace(const v1::StreamFramesRequest& request) {
  return request.has_time_s() || request.has_rate() || request.has_frames_per_second() ||
         request.has_loop() || request.has_lossless() || !request.family().empty();
}

absl::Status CheckPace(const v1::StreamFramesRequest& values) {
  const double fps = values.frames_per_second();
  FieldViolations violations;
  violations.AddIf(
      !(std::abs(values.rate()) <= kMaxRate), "rate",
      absl::StrCat("must be in [", -kMaxRate, ", ", kMaxRate, "], got ", values.rate()));
  violations.AddIf(values.has_frames_per_second() && !(fps > 0 && fps <= kMaxFramesPerSecond),
                   "frames_per_second",
                   absl::StrCat("must be in (0, ", kMaxFramesPerSecond, "], got ", fps));
  violations.AddIf(values.lossless() && values.has_rate() && values.rate() == 0, "rate",
                   "must not be 0 in a lossless stream, which would never end");
  return violations.ToStatus();
}

absl::Status CheckTime(double time_s, double duration_s) {
  if (time_s >= 0 && time_s <= duration_s) return absl::OkStatus();
  return AtField("time_s", absl::OutOfRangeError(
                               absl::StrCat("must be in [0, ", duration_s, "], got ", time_s)));
}

}  // namespace

void MergeRequest(const v1::StreamFramesRequest& newer, v1::StreamFramesRequest& request) {
  if (!newer.weights().empty() || !newer.parameters().empty()) {
    request.clear_weights();
    request.clear_parameters();
  }
  if (newer.has_surface()) request.clear_surface();
  request.MergeFrom(newer);
}

absl::Status FrameStream::Change(const v1::StreamFramesRequest& request, absl::Duration now) {
  MergeRequest(request, values_);
  values_.clear_time_s();
  LB_RETURN_IF_ERROR(CheckPace(values_));
  if (!request.family().empty() || loaded_ == nullptr) {
    LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("family", values_.family()));
    LB_ASSIGN_OR_RETURN(loaded_, backends_.families.Get(id));
  }
  const AskedBlend blend = {values_.weights(), values_.parameters(), values_.extrapolate()};
  LB_RETURN_IF_ERROR(SetWeights(*loaded_, blend, query_));
  query_.encoding = values_.encoding();
  query_.surface = values_.surface();
  LB_RETURN_IF_ERROR(CheckQuery(loaded_->family, query_));
  std::optional<double> time_s;
  if (request.has_time_s()) {
    LB_RETURN_IF_ERROR(CheckTime(request.time_s(), loaded_->family.duration_s()));
    time_s = request.time_s();
  }
  if (SetsPace(request)) pacer_.Change(PaceOf(values_), time_s, now);
  return absl::OkStatus();
}

Pace FrameStream::PaceOf(const v1::StreamFramesRequest& values) const {
  Pace pace;
  pace.duration_s = loaded_->family.duration_s();
  pace.frames_per_second = values.has_frames_per_second() ? values.frames_per_second()
                                                          : loaded_->family.frames_per_second;
  pace.rate = values.has_rate() ? values.rate() : 1.0;
  pace.loop = values.loop();
  pace.lossless = values.lossless();
  return pace;
}

absl::StatusOr<v1::StreamFramesResponse> FrameStream::Make(const FramePacer::Tick& tick) {
  query_.time_s = tick.time_s;
  std::unique_ptr<FrameBuffers> buffers = backends_.buffers.Take();
  absl::StatusOr<v1::Frame> frame = MakeFrame(*loaded_, query_, *buffers);
  backends_.buffers.GiveBack(std::move(buffers));
  LB_RETURN_IF_ERROR(frame.status());
  pacer_.Advance();
  v1::StreamFramesResponse response;
  *response.mutable_frame() = *std::move(frame);
  response.set_frame_index(num_made_++);
  response.set_num_dropped(pacer_.num_skipped());
  return response;
}

}  // namespace liquidblend::rpc
