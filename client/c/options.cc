#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"
#include "client/src/status_macros.h"

namespace liquidblend::c_api {
namespace {

constexpr uint32_t kAllAttributes = LB_NORMALS | LB_VELOCITIES | LB_REST_POSITIONS;
constexpr int kMostMeshoptBits = 16;

absl::Duration SecondsOr(double seconds, absl::Duration otherwise) {
  return seconds == 0.0 ? otherwise : absl::Seconds(seconds);
}

}  // namespace

absl::StatusOr<player::Allocator> AllocatorOf(const lb_allocator* allocator) {
  if (allocator == nullptr) return player::Allocator();
  lb_allocator given;
  LBC_RETURN_IF_ERROR(Read(allocator, "allocator", given));
  if (given.allocate == nullptr) return InvalidArgument("allocator.allocate", "is NULL");
  if (given.release == nullptr) return InvalidArgument("allocator.release", "is NULL");
  return player::Allocator{given.allocate, given.release, given.user};
}

absl::StatusOr<ConnectOptions> ConnectOptionsOf(const lb_connect_options& options) {
  ConnectOptions result;
  if (options.target != nullptr) result.target = options.target;
  for (const double seconds :
       {options.connect_timeout_s, options.call_timeout_s, options.patience_s}) {
    if (!std::isfinite(seconds)) return InvalidArgument("a time of options", "is not finite");
  }
  result.connect_timeout = SecondsOr(options.connect_timeout_s, result.connect_timeout);
  result.call_timeout = SecondsOr(options.call_timeout_s, result.call_timeout);
  result.retry.is_patient = options.patience_s >= 0.0;
  result.retry.patience = SecondsOr(options.patience_s, result.retry.patience);
  if (!result.retry.is_patient) {
    result.retry.patience = absl::ZeroDuration();
    result.retry.max_attempts = 1;
  }
  SecurityOptions& security = result.security;
  security.tls = options.tls != 0;
  security.tls_ca = TextOf(options.tls_ca);
  security.tls_cert = TextOf(options.tls_cert);
  security.tls_key = TextOf(options.tls_key);
  security.tls_server_name = TextOf(options.tls_server_name);
  security.token = TextOf(options.token);
  const TraceHeaders trace = {TextOf(options.traceparent), ""};
  if (!trace.traceparent.empty()) result.trace = [trace] { return trace; };
  LBC_RETURN_IF_ERROR(result.Validate());
  return result;
}

absl::StatusOr<SurfaceOptions> SurfaceOptionsOf(const lb_surface& surface) {
  if ((surface.attributes & ~kAllAttributes) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("surface.attributes ", surface.attributes, " has an unknown attribute"));
  }
  SurfaceOptions options;
  options.level_of_detail = surface.level_of_detail;
  options.smoothing_passes = surface.smoothing_passes;
  options.smoothing = surface.laplacian != 0 ? Smoothing::kLaplacian : Smoothing::kTaubin;
  options.smoothing_strength = surface.smoothing_strength;
  options.temporal_smoothing = surface.temporal_smoothing;
  options.normals = (surface.attributes & LB_NORMALS) != 0;
  options.velocities = (surface.attributes & LB_VELOCITIES) != 0;
  options.rest_positions = (surface.attributes & LB_REST_POSITIONS) != 0;
  return options;
}

FrameFormat FormatOf(int position_bits) {
  return position_bits > kMostMeshoptBits ? FrameFormat::kDraco : FrameFormat::kMeshopt;
}

absl::StatusOr<std::vector<double>> WeightsOf(const double* weights, size_t count) {
  if (count > 0 && weights == nullptr) return InvalidArgument("weights", "is NULL");
  return std::vector<double>(weights, weights + count);
}

absl::StatusOr<Parameters> ParametersOf(const lb_parameter* parameters, size_t count) {
  Parameters result;
  if (count > 0 && parameters == nullptr) return InvalidArgument("parameters", "is NULL");
  for (size_t k = 0; k < count; ++k) {
    if (parameters[k].name == nullptr) return InvalidArgument("a parameter's name", "is NULL");
    if (!std::isfinite(parameters[k].value)) {
      return InvalidArgument(parameters[k].name, "is not finite");
    }
    if (result.emplace(parameters[k].name, parameters[k].value).second) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("parameter ", parameters[k].name, " is given twice"));
  }
  return result;
}

}  // namespace liquidblend::c_api
