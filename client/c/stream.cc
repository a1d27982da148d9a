// Streams of frames.
#include <optional>
#include <utility>

#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"
#include "client/src/status_macros.h"
#include "liquidblend/frame_stream.h"

namespace liquidblend::c_api {
namespace {

absl::StatusOr<StreamSettings> SettingsOf(const lb_stream_request& from) {
  StreamSettings settings;
  settings.family = TextOf(from.family);
  settings.version = from.version;
  LBC_ASSIGN_OR_RETURN(settings.weights, WeightsOf(from.weights, from.num_weights));
  LBC_ASSIGN_OR_RETURN(settings.parameters, ParametersOf(from.parameters, from.num_parameters));
  settings.extrapolate = from.extrapolate != 0;
  lb_surface surface;
  LBC_RETURN_IF_ERROR(ReadOrDefault(from.surface, "surface", surface));
  LBC_ASSIGN_OR_RETURN(settings.surface, SurfaceOptionsOf(surface));
  settings.position_bits = surface.position_bits;
  settings.format = FormatOf(surface.position_bits);
  settings.time_s = from.time_s;
  if (from.rate != 0.0) settings.rate = from.rate;
  if (from.frames_per_second != 0.0) settings.frames_per_second = from.frames_per_second;
  settings.loop = from.loop != 0;
  settings.lossless = from.live == 0;
  settings.adapt_level_of_detail = from.live != 0 && from.adapts_detail != 0;
  return settings;
}

// Null at the end.
absl::StatusOr<std::unique_ptr<lb_frame>> ReadFrame(lb_stream& stream) {
  LBC_ASSIGN_OR_RETURN(const auto streamed, stream.stream->Read());
  if (!streamed.has_value()) return std::unique_ptr<lb_frame>();
  const auto mesh = stream.pool->Take();
  LBC_RETURN_IF_ERROR(
      stream.fetcher.Decode(streamed->frame, streamed->level_of_detail, *stream.pool, *mesh));
  auto frame = std::make_unique<lb_frame>();
  frame->mesh = mesh;
  return frame;
}

}  // namespace
}  // namespace liquidblend::c_api

namespace c_api = liquidblend::c_api;

extern "C" {

lb_status lb_stream_open(lb_client* client, const lb_stream_request* request, lb_stream** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_stream>> {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    lb_stream_request given;
    LBC_RETURN_IF_ERROR(c_api::Read(request, "request", given));
    LBC_ASSIGN_OR_RETURN(const auto settings, c_api::SettingsOf(given));
    auto handle = std::make_unique<lb_stream>(client->client, client->pool);
    LBC_ASSIGN_OR_RETURN(handle->stream, client->client->StreamFrames(settings));
    return handle;
  });
}

lb_status lb_stream_next(lb_stream* stream, lb_frame** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_frame>> {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(stream, "stream"));
    absl::StatusOr<std::unique_ptr<lb_frame>> frame = c_api::ReadFrame(*stream);
    if (!frame.ok()) stream->stream->Cancel();
    return frame;
  });
}

void lb_stream_cancel(lb_stream* stream) {
  if (stream != nullptr) stream->stream->Cancel();
}

void lb_stream_free(lb_stream* stream) { delete stream; }

}  // extern "C"
