#include "server/frames/frame_stream.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/mesh/option_ranges.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/frames/query_weights.h"

namespace liquidblend::server {
namespace {

constexpr uint32_t kLengthDelimited = 2;  // protobuf's wire type of messages

// Range of frames per second of a stream's clock. The lowest is a frame every 1000 seconds.
constexpr mesh::Range kClockFramesPerSecond = {0.001, 240.0};
constexpr double kMaxRate = 1000.0;
constexpr int32_t kMaxCredit = 1'000'000;  // frames that are open at a time

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
  violations.AddIf(values.has_frames_per_second() && !kClockFramesPerSecond.Holds(fps),
                   "frames_per_second",
                   absl::StrCat("must be in [", kClockFramesPerSecond.min, ", ",
                                kClockFramesPerSecond.max, "], got ", fps));
  violations.AddIf(values.lossless() && values.has_rate() && values.rate() == 0, "rate",
                   "must not be 0 in a lossless stream, which would never end");
  return violations.ToStatus();
}

absl::Status CheckTime(double time_s, double duration_s) {
  if (time_s >= 0 && time_s <= duration_s) return absl::OkStatus();
  return AtField("time_s", absl::OutOfRangeError(
                               absl::StrCat("must be in [0, ", duration_s, "], got ", time_s)));
}

// A negative one stays, so that it is refused.
int64_t SumOfCredits(int64_t a, int64_t b) {
  if (a < 0 || b < 0) return std::min(a, b);
  return std::min(a + b, std::max({a, b, int64_t{kMaxCredit}}));
}

}  // namespace

void MergeRequest(const v1::StreamFramesRequest& newer, v1::StreamFramesRequest& request) {
  if (!newer.weights().empty() || !newer.parameters().empty()) {
    request.clear_weights();
    request.clear_parameters();
  }
  if (newer.has_surface()) request.clear_surface();
  if (!newer.family().empty() || newer.version() != 0 || newer.min_version() != 0) {
    request.clear_version();
    request.clear_min_version();
  }
  if (newer.encoding().position_bits() != 0 || newer.encoding().position_step_m() != 0) {
    request.mutable_encoding()->clear_position_bits();
    request.mutable_encoding()->clear_position_step_m();
  }
  const int64_t credit = SumOfCredits(newer.credit(), request.credit());
  request.MergeFrom(newer);
  if (request.has_credit()) request.set_credit(static_cast<int32_t>(credit));
  // MergeFrom() appends unknown fields, so they would grow with every message.
  request.DiscardUnknownFields();
}

std::string ResponsePrefix(const StreamedFrame& streamed) {
  v1::StreamFramesResponse response;
  response.set_frame_index(streamed.frame_index);
  response.set_num_dropped(streamed.num_dropped);
  response.set_level_of_detail(streamed.level_of_detail);
  if (streamed.next_time_s.has_value()) response.set_next_time_s(*streamed.next_time_s);
  response.set_num_requests(streamed.num_requests);
  std::string prefix = response.SerializeAsString();
  google::protobuf::io::StringOutputStream stream(&prefix);  // appends
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.WriteTag((v1::StreamFramesResponse::kFrameFieldNumber << 3) | kLengthDelimited);
  coded.WriteVarint64(streamed.frame->size());
  coded.Trim();
  return prefix;
}

catalog::AskedVersion VersionOf(const v1::StreamFramesRequest& request) {
  return {request.version(), request.min_version()};
}

absl::StatusOr<std::optional<std::string>> FrameStream::FamilyToFind(
    const v1::StreamFramesRequest& request) const {
  if (request.min_version() < 0) return InvalidField("min_version", "must not be negative");
  if (request.version() < 0) return InvalidField("version", "must not be negative");
  if (request.family().empty() && has_begun()) {
    const int64_t shown = loaded_->family.version;
    if (VersionOf(request).Allows(shown)) return std::optional<std::string>();
    return std::optional<std::string>(loaded_->family.name);
  }
  LB_ASSIGN_OR_RETURN(std::string id, FamilyId("family", request.family()));
  return std::optional<std::string>(std::move(id));
}

absl::Status FrameStream::Change(const v1::StreamFramesRequest& request, catalog::FamilyPtr found,
                                 absl::Duration now) {
  MergeRequest(request, values_);
  values_.clear_time_s();
  values_.clear_credit();
  LB_RETURN_IF_ERROR(CheckPace(values_));
  LB_RETURN_IF_ERROR(TakeCredit(request));
  if (found != nullptr) loaded_ = std::move(found);
  const AskedBlend blend = {values_.weights(), values_.parameters(), values_.extrapolate()};
  LB_RETURN_IF_ERROR(SetWeights(*loaded_, blend, query_));
  query_.encoding = values_.encoding();
  query_.surface = values_.surface();
  LB_RETURN_IF_ERROR(CheckQuery(*loaded_, query_));
  std::optional<double> time_s;
  if (request.has_time_s()) {
    LB_RETURN_IF_ERROR(CheckTime(request.time_s(), loaded_->family.duration_s()));
    time_s = request.time_s();
  }
  if (SetsPace(request)) pacer_.Change(PaceOf(values_), time_s, now);
  return absl::OkStatus();
}

absl::Status FrameStream::TakeCredit(const v1::StreamFramesRequest& request) {
  if (!request.has_credit()) return absl::OkStatus();
  if (request.credit() < 0 || request.credit() > kMaxCredit) {
    return InvalidField("credit",
                        absl::StrCat("must be in [0, ", kMaxCredit, "], got ", request.credit()));
  }
  credit_left_ = std::min<int64_t>(credit_left_.value_or(0) + request.credit(), kMaxCredit);
  return absl::OkStatus();
}

// The animation's frame rate, limited to the clock's range unless the stream is lossless.
double FrameStream::DefaultFramesPerSecond(const v1::StreamFramesRequest& values) const {
  const double fps = loaded_->family.frames_per_second;
  const mesh::Range range = values.lossless() ? mesh::kFramesPerSecond : kClockFramesPerSecond;
  return std::clamp(fps, range.min, range.max);
}

Pace FrameStream::PaceOf(const v1::StreamFramesRequest& values) const {
  Pace pace;
  pace.duration_s = loaded_->family.duration_s();
  pace.frames_per_second =
      values.has_frames_per_second() ? values.frames_per_second() : DefaultFramesPerSecond(values);
  pace.rate = values.has_rate() ? values.rate() : 1.0;
  pace.loop = values.loop();
  pace.lossless = values.lossless();
  return pace;
}

int FrameStream::max_coarser() const {
  return static_cast<int>(loaded_->levels.size()) - 1 - query_.surface.level_of_detail();
}

FrameQuery FrameStream::QueryAt(const FramePacer::Tick& tick) const {
  FrameQuery query = query_;
  query.time_s = tick.time_s;
  if (values_.adapt_level_of_detail() && is_paced()) {
    const int num_coarser = std::min(level_chooser_.num_coarser(), max_coarser());
    query.surface.set_level_of_detail(query_.surface.level_of_detail() + num_coarser);
  }
  return query;
}

absl::Duration FrameStream::period() const {
  return absl::Seconds(1) / PaceOf(values_).frames_per_second;
}

StreamedFrame FrameStream::Sent(const FrameQuery& query, FramePtr frame) {
  pacer_.Advance();
  if (credit_left_.has_value()) --*credit_left_;
  StreamedFrame sent;
  sent.frame = std::move(frame);
  sent.frame_index = num_sent_++;
  sent.num_dropped = pacer_.num_skipped();
  sent.level_of_detail = query.surface.level_of_detail();
  sent.next_time_s = pacer_.NextTime();
  return sent;
}

void FrameStream::OnWritten(absl::Duration took, absl::Duration now) {
  level_chooser_.OnWritten(took, period(), max_coarser(), now);
}

}  // namespace liquidblend::server
