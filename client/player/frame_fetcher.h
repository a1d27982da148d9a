// Fetches frames from a server into the memory of a pool.
#pragma once

#include <atomic>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/player/frame_source.h"
#include "client/src/decode/meshopt_decoder.h"
#include "core/base/object_pool.h"
#include "liquidblend/client.h"

namespace liquidblend::player {

// Threads: safe.
class FrameFetcher {
 public:
  // `client` outlives this.
  explicit FrameFetcher(Client& client) : client_(client) {}

  // Asks for the frame and decodes it. A server that is too old for MESHOPT is asked for Draco.
  // Errors: the server's; kDataLoss (damaged bytes), kResourceExhausted (no memory).
  absl::Status Get(const FrameRequest& request, FramePool& pool, FrameMesh& out, FrameCost& cost);
  // Makes a mesh of a frame that is there already, with its facts.  Errors: likewise.
  absl::Status Decode(const Frame& frame, int level_of_detail, FramePool& pool, FrameMesh& out);

 private:
  absl::StatusOr<Frame> Fetch(FrameRequest request);
  absl::Status DecodeMesh(const Frame& frame, FramePool& pool, FrameMesh& out);

  Client& client_;
  std::atomic<bool> has_meshopt_ = true;  // false: the server is too old for it
  base::ObjectPool<client::MeshoptDecoder> decoders_;
};

}  // namespace liquidblend::player
