// Validate() of the public options.
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"
#include "liquidblend/animation.h"
#include "liquidblend/client.h"
#include "liquidblend/family.h"
#include "liquidblend/security.h"
#include "liquidblend/space_time.h"

namespace liquidblend {
namespace {

// [lowest, highest]; an infinite `highest` means any finite number.
absl::Status CheckRange(const char* field, double value, double lowest, double highest = INFINITY) {
  if (std::isfinite(value) && value >= lowest && value <= highest) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", value, "; it must be ",
                   std::isinf(highest) ? absl::StrCat(lowest, " or more and finite")
                                       : absl::StrCat("in [", lowest, ", ", highest, "]")));
}

absl::Status CheckNotNegative(const char* field, double value) {
  return CheckRange(field, value, 0.0);
}

absl::Status CheckPositive(const char* field, absl::Duration value) {
  if (value > absl::ZeroDuration()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(field, " is ", absl::FormatDuration(value), "; it must be more than 0"));
}

}  // namespace

absl::Status ImportOptions::Validate() const {
  LBC_RETURN_IF_ERROR(CheckNotNegative("frames_per_second", frames_per_second));
  LBC_RETURN_IF_ERROR(CheckNotNegative("vertex_scale", vertex_scale));
  LBC_RETURN_IF_ERROR(CheckNotNegative("velocity_scale", velocity_scale));
  LBC_RETURN_IF_ERROR(CheckNotNegative("voxel_size_m", voxel_size_m));
  for (size_t k = 0; k < frame_times.size(); ++k) {
    const std::string field = absl::StrCat("frame_times[", k, "]");
    LBC_RETURN_IF_ERROR(CheckRange(field.c_str(), frame_times[k], k == 0 ? 0 : frame_times[k - 1]));
  }
  return absl::OkStatus();
}

absl::Status RegistrationOptions::Validate() const {
  absl::Status status;
  ForEach(*this, [&](const char* name, const auto& option) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(option)>>) {
      status.Update(CheckNotNegative(name, static_cast<double>(option)));
    }
  });
  return status;
}

absl::Status SpaceTimeOptions::Validate() const {
  LBC_RETURN_IF_ERROR(CheckNotNegative("spacing_edges", spacing_edges));
  LBC_RETURN_IF_ERROR(CheckNotNegative("droplet_vertices", droplet_vertices.value_or(0)));
  LBC_RETURN_IF_ERROR(CheckNotNegative("sheet_thickness_edges", sheet_thickness_edges.value_or(0)));
  return CheckNotNegative("coarser_levels", coarser_levels.value_or(0));
}

absl::Status SecurityOptions::Validate() const {
  if (tls_cert.empty() != tls_key.empty()) {
    return absl::InvalidArgumentError(tls_cert.empty() ? "tls_key is given without tls_cert"
                                                       : "tls_cert is given without tls_key");
  }
  const bool is_visible = std::all_of(token.begin(), token.end(), [](char c) {
    return absl::ascii_isgraph(static_cast<unsigned char>(c));
  });
  if (is_visible) return absl::OkStatus();
  return absl::InvalidArgumentError("token must be of visible ASCII characters, without blanks");
}

absl::Status ConnectOptions::Validate() const {
  if (target.empty()) return absl::InvalidArgumentError("target is empty; it must be HOST:PORT");
  if (absl::StartsWith(target, ",") || absl::EndsWith(target, ",") ||
      absl::StrContains(target, ",,")) {
    return absl::InvalidArgumentError(
        absl::StrCat("target is '", target, "'; one of its addresses is empty"));
  }
  for (const char* scheme : {"http://", "https://"}) {
    if (!absl::StrContains(target, scheme)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "target is '", target, "'; it must be HOST:PORT, without ", scheme, " (--tls is for TLS)"));
  }
  LBC_RETURN_IF_ERROR(CheckPositive("connect_timeout", connect_timeout));
  LBC_RETURN_IF_ERROR(CheckPositive("call_timeout", call_timeout));
  LBC_RETURN_IF_ERROR(CheckPositive("upload_timeout", upload_timeout));
  LBC_RETURN_IF_ERROR(CheckRange("keepalive (seconds)", absl::ToDoubleSeconds(keepalive), 1, 3600));
  LBC_RETURN_IF_ERROR(CheckRange("retry.max_attempts", retry.max_attempts, 1));
  LBC_RETURN_IF_ERROR(CheckPositive("retry.initial_backoff", retry.initial_backoff));
  LBC_RETURN_IF_ERROR(CheckPositive("retry.max_backoff", retry.max_backoff));
  LBC_RETURN_IF_ERROR(CheckNotNegative("retry.patience", absl::ToDoubleSeconds(retry.patience)));
  return security.Validate();
}

}  // namespace liquidblend
