// Fetches frames from a server into the memory of a pool.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "client/player/frame_source.h"
#include "client/src/decode/meshopt_decoder.h"
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

 private:
  absl::StatusOr<Frame> Fetch(FrameRequest request);
  absl::Status Decode(const Frame& frame, FramePool& pool, FrameMesh& out);
  std::unique_ptr<client::MeshoptDecoder> TakeDecoder();
  void GiveBack(std::unique_ptr<client::MeshoptDecoder> decoder);

  Client& client_;
  std::atomic<bool> has_meshopt_ = true;  // false: the server is too old for it
  absl::Mutex mutex_;
  std::vector<std::unique_ptr<client::MeshoptDecoder>> free_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace liquidblend::player
