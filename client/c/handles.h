// What is behind the handles of the C API.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/player/frame_fetcher.h"
#include "client/player/frame_pool.h"
#include "client/player/player.h"
#include "liquidblend/client.h"
#include "liquidblend/frame_stream.h"
#include "liquidblend/liquidblend.h"

struct lb_client {
  lb_client(std::shared_ptr<liquidblend::Client> connected,
            const liquidblend::player::Allocator& allocator)
      : client(std::move(connected)),
        fetcher(*client),
        pool(std::make_shared<liquidblend::player::FramePool>(
            allocator, liquidblend::player::Growth::kAsNeeded)) {}
  const std::shared_ptr<liquidblend::Client> client;
  liquidblend::player::FrameFetcher fetcher;
  const std::shared_ptr<liquidblend::player::FramePool> pool;
};

struct lb_text {
  std::string text;
};

struct lb_family {
  liquidblend::player::FamilyFacts facts;
  std::string source;
  std::string json;
  // Arrays that lb_family_describe() points to.
  std::vector<const char*> targets, parameters;
  std::vector<double> points;
};

struct lb_operation {
  liquidblend::Operation operation;
  std::string result_message, reason;
};

struct lb_frame {
  std::atomic<int> num_owners = 1;
  liquidblend::player::FramePtr mesh;
  double velocity_scale = 1.0;
};

struct lb_stream {
  lb_stream(std::shared_ptr<liquidblend::Client> connected,
            std::shared_ptr<liquidblend::player::FramePool> frames)
      : client(std::move(connected)), fetcher(*client), pool(std::move(frames)) {}
  const std::shared_ptr<liquidblend::Client> client;
  liquidblend::player::FrameFetcher fetcher;
  const std::shared_ptr<liquidblend::player::FramePool> pool;
  std::unique_ptr<liquidblend::FrameStream> stream;
};

struct lb_player {
  std::unique_ptr<liquidblend::player::Player> player;
  std::unique_ptr<lb_family> family;
  lb_frame* polled = nullptr;  // the frame of the last poll, owned; null: none
  lb_log_function log = nullptr;
  void* log_user = nullptr;
  absl::Status logged;  // the error that was logged last
};

namespace liquidblend::c_api {

// The allocator, or malloc's for null.  Errors: kInvalidArgument if a function is missing.
absl::StatusOr<player::Allocator> AllocatorOf(const lb_allocator* allocator);

// Errors: kInvalidArgument, naming the field.
absl::StatusOr<ConnectOptions> ConnectOptionsOf(const lb_connect_options& options);

// The surface's options; `position_bits` separately.  Errors: kInvalidArgument, naming the field.
absl::StatusOr<SurfaceOptions> SurfaceOptionsOf(const lb_surface& surface);

// The best format that has so many bits.
FrameFormat FormatOf(int position_bits);

// Weights as given.  Errors: kInvalidArgument if they are null, but not none.
absl::StatusOr<std::vector<double>> WeightsOf(const double* weights, size_t count);

// A point in parameter space.  Errors: kInvalidArgument if a name is null or given twice.
absl::StatusOr<Parameters> ParametersOf(const lb_parameter* parameters, size_t count);

// A family handle that describes a player's, or a server's.
std::unique_ptr<lb_family> MakeFamily(player::FamilyFacts facts, std::string source,
                                      std::string json);
void Describe(const lb_family& family, lb_family_info* info);

}  // namespace liquidblend::c_api
