// A server in this process with one synthetic family, for load tests.
#pragma once

#include <memory>
#include <string>

#include "core/store/blob_store.h"
#include "core/store/catalog.h"
#include "server/catalog/families.h"
#include "server/rpc/server.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::bench {

inline constexpr char kLoadFamily[] = "families/load";
inline constexpr int kLoadFrames = 40;

// A growing torus of quads with one target: weights are one number. At weight 1 events are shifted
// by up to warp_frames. Aborts with a message if it cannot be set up.
class LoadServer {
 public:
  LoadServer(int vertices_per_frame, double warp_frames, int num_threads);

  const std::string& address() const { return server_->address(); }
  double duration_s() const { return duration_s_; }

 private:
  void Publish(int vertices_per_frame, double warp_frames);

  store::TemporaryFolder folder_;
  std::unique_ptr<store::Catalog> catalog_;
  std::unique_ptr<store::BlobStore> blobs_;
  catalog::Families families_;
  std::unique_ptr<rpc::Server> server_;
  double duration_s_ = 0.0;
};

}  // namespace liquidblend::bench
