// Players.
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"
#include "client/player/file_source.h"
#include "client/player/server_source.h"
#include "client/src/status_macros.h"
#include "core/frames/blend_weights.h"

namespace liquidblend::c_api {
namespace {

using player::BlendSpec;
using player::FrameSource;
using player::Player;
using player::PlayerOptions;

absl::StatusOr<PlayerOptions> OptionsOf(const lb_player_options& from) {
  PlayerOptions options;
  lb_surface surface;
  LBC_RETURN_IF_ERROR(ReadOrDefault(from.surface, "surface", surface));
  LBC_ASSIGN_OR_RETURN(options.surface, SurfaceOptionsOf(surface));
  options.position_bits = surface.position_bits;
  if (from.frames_per_second != 0.0) options.schedule.frames_per_second = from.frames_per_second;
  if (from.look_ahead_s != 0.0) {
    options.schedule.look_ahead_s = from.look_ahead_s < 0.0 ? 0.0 : from.look_ahead_s;
  }
  if (from.num_threads != 0) options.num_threads = from.num_threads;
  options.adapts_detail = from.fixed_detail == 0;
  if (from.transport < LB_TRANSPORT_AUTOMATIC || from.transport > LB_TRANSPORT_DRACO) {
    return absl::InvalidArgumentError(absl::StrCat("transport is ", int{from.transport}));
  }
  options.transport = static_cast<player::Transport>(from.transport);
  LBC_ASSIGN_OR_RETURN(options.allocator, AllocatorOf(from.allocator));
  LBC_RETURN_IF_ERROR(options.Validate());
  return options;
}

absl::StatusOr<std::unique_ptr<FrameSource>> OpenSource(const lb_player_options& from) {
  if ((from.file == nullptr) == (from.family == nullptr)) {
    return absl::InvalidArgumentError("give either options.file or options.family");
  }
  if (from.file != nullptr) {
    LBC_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> source, player::FileSource::Open(from.file));
    return source;
  }
  lb_connect_options connect;
  LBC_RETURN_IF_ERROR(ReadOrDefault(from.connect, "options.connect", connect));
  LBC_ASSIGN_OR_RETURN(const ConnectOptions options, ConnectOptionsOf(connect));
  LBC_ASSIGN_OR_RETURN(std::unique_ptr<FrameSource> source,
                       player::ServerSource::Open(options, from.family, from.version));
  return source;
}

absl::Status CheckFinite(const double* values, size_t count, const char* name) {
  if (count > 0 && values == nullptr) return InvalidArgument(name, "is NULL");
  for (size_t k = 0; k < count; ++k) {
    if (!std::isfinite(values[k])) return InvalidArgument(name, "has a number that is not finite");
  }
  return absl::OkStatus();
}

// Logs a failure once, and that it is over.
void LogChange(const absl::Status& now, lb_player& player) {
  if (player.log == nullptr || now == player.logged) return;
  player.logged = now;
  const std::string text =
      now.ok() ? "frames come again" : absl::StrCat("no frames: ", std::string(now.message()));
  player.log(player.log_user, text.c_str());
}

std::unique_ptr<lb_frame> MakeFrame(player::FramePtr mesh, double velocity_scale) {
  auto frame = std::make_unique<lb_frame>();
  frame->mesh = std::move(mesh);
  frame->velocity_scale = velocity_scale;
  return frame;
}

// The frame of the last poll, if it is still right, or a new handle.
lb_frame* Polled(lb_player& player, double now) {
  player::PolledFrame polled = player.player->Poll(now);
  LogChange(polled.error, player);
  if (polled.frame == nullptr) return nullptr;
  lb_frame*& last = player.polled;
  const bool is_same = last != nullptr && last->mesh == polled.frame &&
                       last->velocity_scale == polled.velocity_scale;
  if (!is_same) {
    lb_frame_free(last);
    last = nullptr;
    last = MakeFrame(std::move(polled.frame), polled.velocity_scale).release();
  }
  lb_frame_retain(last);
  return last;
}

absl::Status SetBlend(lb_player* player, const BlendSpec& blend, double over_s) {
  if (!std::isfinite(over_s)) return InvalidArgument("over_s", "is not finite");
  player->player->SetBlend(blend, over_s);
  return absl::OkStatus();
}

double MeanMs(double sum_s, int64_t count) {
  return count > 0 ? 1e3 * sum_s / static_cast<double>(count) : 0.0;
}

}  // namespace
}  // namespace liquidblend::c_api

namespace c_api = liquidblend::c_api;
using liquidblend::frames::kMaxWeight;
using liquidblend::frames::kMinWeight;
using liquidblend::player::BlendSpec;
using liquidblend::player::Player;

extern "C" {

lb_status lb_player_open(const lb_player_options* options, lb_player** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_player>> {
    lb_player_options given;
    LBC_RETURN_IF_ERROR(c_api::Read(options, "options", given));
    LBC_ASSIGN_OR_RETURN(const auto player_options, c_api::OptionsOf(given));
    LBC_ASSIGN_OR_RETURN(auto source, c_api::OpenSource(given));
    const int num_levels = source->facts().num_levels,
              level = player_options.surface.level_of_detail;
    if (level < 0 || level >= num_levels) {
      return absl::InvalidArgumentError(
          absl::StrCat("surface.level_of_detail is ", level, ", not in [0, ", num_levels - 1, "]"));
    }
    auto handle = std::make_unique<lb_player>();
    handle->family = c_api::MakeFamily(source->facts(), "", "");
    handle->player =
        std::make_unique<liquidblend::player::Player>(std::move(source), player_options);
    handle->log = given.log;
    handle->log_user = given.log_user;
    return handle;
  });
}

void lb_player_free(lb_player* player) {
  if (player == nullptr) return;
  lb_frame_free(player->polled);
  delete player;
}

void lb_player_describe(const lb_player* player, lb_family_info* info) {
  if (player != nullptr) c_api::Describe(*player->family, info);
}

lb_status lb_player_set_weights(lb_player* player, size_t num_weights, const double* weights,
                                double over_s) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(player, "player"));
    LBC_RETURN_IF_ERROR(c_api::CheckFinite(weights, num_weights, "weights"));
    const size_t wanted = player->family->targets.size();
    if (num_weights != wanted) {
      return absl::InvalidArgumentError(
          absl::StrCat(num_weights, " weights for ", wanted, " targets"));
    }
    for (size_t k = 0; k < num_weights; ++k) {
      if (weights[k] >= kMinWeight && weights[k] <= kMaxWeight) continue;
      return absl::InvalidArgumentError(absl::StrCat(
          "weights[", k, "] is ", weights[k], ", not in [", kMinWeight, ", ", kMaxWeight, "]"));
    }
    BlendSpec blend;
    blend.weights.assign(weights, weights + num_weights);
    return c_api::SetBlend(player, blend, over_s);
  });
}

lb_status lb_player_set_parameters(lb_player* player, size_t num_parameters,
                                   const lb_parameter* parameters, int32_t extrapolate,
                                   double over_s) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(player, "player"));
    if (num_parameters == 0) return c_api::InvalidArgument("parameters", "are none");
    BlendSpec blend;
    blend.extrapolate = extrapolate != 0;
    LBC_ASSIGN_OR_RETURN(blend.parameters, c_api::ParametersOf(parameters, num_parameters));
    return c_api::SetBlend(player, blend, over_s);
  });
}

void lb_player_play(lb_player* player) {
  if (player != nullptr) player->player->SetPlaying(true);
}

void lb_player_pause(lb_player* player) {
  if (player != nullptr) player->player->SetPlaying(false);
}

void lb_player_set_loop(lb_player* player, int32_t loop) {
  if (player != nullptr) player->player->SetLoop(loop != 0);
}

lb_status lb_player_set_rate(lb_player* player, double rate) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(player, "player"));
    LBC_RETURN_IF_ERROR(c_api::CheckFinite(&rate, 1, "rate"));
    player->player->SetRate(rate);
    return absl::OkStatus();
  });
}

lb_status lb_player_seek(lb_player* player, double time_s) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(player, "player"));
    LBC_RETURN_IF_ERROR(c_api::CheckFinite(&time_s, 1, "time_s"));
    player->player->Seek(time_s);
    return absl::OkStatus();
  });
}

lb_frame* lb_player_poll(lb_player* player, double now) {
  if (player == nullptr || !(std::abs(now) <= Player::kLongestClock_s)) return nullptr;
  lb_frame* frame = nullptr;
  c_api::Guarded([&] {
    frame = c_api::Polled(*player, now);
    return absl::OkStatus();
  });
  return frame;
}

lb_status lb_player_wait_exact(lb_player* player, double time_s, double patience_s,
                               lb_frame** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_frame>> {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(player, "player"));
    LBC_RETURN_IF_ERROR(c_api::CheckFinite(&patience_s, 1, "patience_s"));
    LBC_ASSIGN_OR_RETURN(auto mesh, player->player->WaitExact(time_s, patience_s));
    return c_api::MakeFrame(std::move(mesh), 1.0);
  });
}

void lb_player_statistics(const lb_player* player, lb_player_info* info) {
  if (player == nullptr) return;
  const liquidblend::player::PlayerStatistics from = player->player->statistics();
  lb_player_info out = {};
  out.num_shown = from.counts.num_shown;
  out.num_missed = from.counts.num_missed;
  out.num_stale = from.counts.num_stale;
  out.num_received = from.num_received;
  out.num_bytes = from.num_bytes;
  out.wait_ms = c_api::MeanMs(from.wait_s, from.num_received);
  out.decode_ms = c_api::MeanMs(from.decode_s, from.num_received);
  out.latency_ms = 1e3 * from.latency_s;
  out.level_of_detail = from.level_of_detail;
  out.transport =
      from.format == liquidblend::FrameFormat::kDraco ? LB_TRANSPORT_DRACO : LB_TRANSPORT_MESHOPT;
  out.status = static_cast<lb_status>(from.last_error.code());
  c_api::Write(out, info);
}

}  // extern "C"
