// Conversion of requests for frames.
#include "client/src/convert.h"
#include "client/src/names.h"

namespace liquidblend::client {
namespace {

void SetSurface(const SurfaceOptions& surface, v1::SurfaceOptions* proto) {
  proto->set_level_of_detail(surface.level_of_detail);
  proto->set_smoothing_passes(surface.smoothing_passes);
  proto->set_smoothing(surface.smoothing == Smoothing::kLaplacian ? v1::SurfaceOptions::LAPLACIAN
                                                                  : v1::SurfaceOptions::TAUBIN);
  proto->set_smoothing_strength(surface.smoothing_strength);
  proto->set_temporal_smoothing(surface.temporal_smoothing);
  if (surface.normals) proto->add_attributes(v1::SurfaceOptions::NORMALS);
  if (surface.velocities) proto->add_attributes(v1::SurfaceOptions::VELOCITIES);
  if (surface.rest_positions) proto->add_attributes(v1::SurfaceOptions::REST_POSITIONS);
}

v1::Encoding::Preset ToProto(EncodingPreset preset) {
  switch (preset) {
    case EncodingPreset::kBalanced:
      return v1::Encoding::BALANCED;
    case EncodingPreset::kSmallest:
      return v1::Encoding::SMALLEST;
    default:
      return v1::Encoding::FASTEST;
  }
}

v1::Encoding::Format ToProto(FrameFormat format) {
  return format == FrameFormat::kMeshopt ? v1::Encoding::MESHOPT : v1::Encoding::DRACO;
}

template <typename Request>
void SetParameters(const Parameters& parameters, Request* proto) {
  for (const auto& [name, value] : parameters) {
    v1::Parameter* parameter = proto->add_parameters();
    parameter->set_name(name);
    parameter->set_value(value);
  }
}

}  // namespace

v1::GetFrameRequest ToProto(const FrameRequest& request) {
  v1::GetFrameRequest proto;
  proto.set_family(ResourceName("families", request.family));
  proto.mutable_weights()->Assign(request.weights.begin(), request.weights.end());
  SetParameters(request.parameters, &proto);
  proto.set_extrapolate(request.extrapolate);
  proto.set_time_s(request.time_s);
  proto.mutable_encoding()->set_position_bits(request.position_bits);
  proto.mutable_encoding()->set_position_step_m(request.position_step_m);
  if (request.format == FrameFormat::kDraco) {
    proto.mutable_encoding()->set_preset(ToProto(request.encoding));
  } else {
    proto.mutable_encoding()->set_format(ToProto(request.format));
  }
  proto.set_version(request.version);
  proto.set_min_version(request.min_version);
  if (request.surface != SurfaceOptions()) SetSurface(request.surface, proto.mutable_surface());
  return proto;
}

v1::StreamFramesRequest ToProto(const StreamSettings& settings) {
  v1::StreamFramesRequest proto;
  if (!settings.family.empty()) proto.set_family(ResourceName("families", settings.family));
  proto.mutable_weights()->Assign(settings.weights.begin(), settings.weights.end());
  SetParameters(settings.parameters, &proto);
  if (settings.extrapolate) proto.set_extrapolate(*settings.extrapolate);
  if (settings.time_s) proto.set_time_s(*settings.time_s);
  if (settings.rate) proto.set_rate(*settings.rate);
  if (settings.frames_per_second) proto.set_frames_per_second(*settings.frames_per_second);
  if (settings.position_bits != 0) {
    proto.mutable_encoding()->set_position_bits(settings.position_bits);
  }
  if (settings.position_step_m != 0.0) {
    proto.mutable_encoding()->set_position_step_m(settings.position_step_m);
  }
  if (settings.encoding) proto.mutable_encoding()->set_preset(ToProto(*settings.encoding));
  if (settings.format) proto.mutable_encoding()->set_format(ToProto(*settings.format));
  if (settings.loop) proto.set_loop(*settings.loop);
  if (settings.lossless) proto.set_lossless(*settings.lossless);
  if (settings.surface) SetSurface(*settings.surface, proto.mutable_surface());
  if (settings.adapt_level_of_detail) {
    proto.set_adapt_level_of_detail(*settings.adapt_level_of_detail);
  }
  if (settings.version == 0) proto.set_min_version(settings.min_version);
  proto.set_version(settings.version);
  return proto;
}

}  // namespace liquidblend::client
