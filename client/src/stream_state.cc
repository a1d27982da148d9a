#include "client/src/stream_state.h"

#include <algorithm>
#include <utility>

#include "client/src/convert.h"

namespace liquidblend::client {
namespace {

void Merge(const v1::StreamFramesRequest& change, v1::StreamFramesRequest& settings) {
  if (change.weights_size() > 0 || change.parameters_size() > 0) {
    settings.clear_weights();
    settings.clear_parameters();
  }
  if (change.has_surface()) settings.clear_surface();
  if (change.encoding().position_bits() != 0 || change.encoding().position_step_m() != 0) {
    settings.mutable_encoding()->clear_position_bits();
    settings.mutable_encoding()->clear_position_step_m();
  }
  if (!change.family().empty() || change.version() != 0 || change.min_version() != 0) {
    settings.clear_version();
    settings.clear_min_version();
  }
  settings.MergeFrom(change);
}

}  // namespace

v1::StreamFramesRequest StreamState::Begin() {
  num_requests_ = num_until_time_ = num_until_family_ = 1;
  first_index_ = next_index_;
  first_dropped_ = num_dropped_;
  v1::StreamFramesRequest first = settings_;
  if (!MayPinVersion()) return first;
  first.clear_min_version();
  if (allows_newer_) {
    first.set_min_version(version_);
  } else {
    first.set_version(version_);
  }
  return first;
}

// Whether the version so far is what was asked for: not if a newer one was.
bool StreamState::MayPinVersion() const {
  return version_ > 0 && settings_.version() == 0 && settings_.min_version() <= version_;
}

bool StreamState::AllowNewerVersion() {
  if (!MayPinVersion()) return false;
  return !std::exchange(allows_newer_, true);
}

void StreamState::Change(const v1::StreamFramesRequest& change) {
  ++num_requests_;
  is_complete_ = false;
  Merge(change, settings_);
  if (change.has_time_s()) num_until_time_ = num_requests_;
  if (change.family().empty()) return;
  num_until_family_ = num_requests_;
  version_ = 0;
}

// Frames that were made before a change came say nothing of what follows it.
StreamedFrame StreamState::Take(v1::StreamFramesResponse&& response) {
  const int64_t num_shown = response.num_requests();
  is_next_known_ = num_shown > 0;
  is_complete_ = is_next_known_ && !response.has_next_time_s() && num_shown >= num_requests_;
  if (num_shown >= num_until_time_ && response.has_next_time_s()) {
    settings_.set_time_s(response.next_time_s());
  }
  if (num_shown >= num_until_family_) {
    version_ = response.frame().version();
    allows_newer_ = false;
  }
  StreamedFrame streamed;
  streamed.frame_index = first_index_ + response.frame_index();
  streamed.num_dropped = first_dropped_ + response.num_dropped();
  streamed.level_of_detail = response.level_of_detail();
  streamed.frame = FromProto(std::move(*response.mutable_frame()));
  next_index_ = streamed.frame_index + 1;
  num_dropped_ = streamed.num_dropped;
  return streamed;
}

}  // namespace liquidblend::client
