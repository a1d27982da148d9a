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

// Seconds since the server's start, by stage, and the frames that were made.
struct StageSums {
  double queue_s = 0.0;
  double slice_s = 0.0;
  double encode_s = 0.0;
  double num_frames = 0.0;
};

// A growing torus of quads with one target: weights are one number. At weight 1 events are shifted
// by up to warp_frames, so that frames have more vertices than the source's: vertices_per_frame on
// average over weights in [0, 1] and times. Aborts with a message if it cannot be set up.
class LoadServer {
 public:
  LoadServer(int vertices_per_frame, double warp_frames, int num_threads, double frame_cache_mb);

  const std::string& address() const { return server_->address(); }
  double duration_s() const { return duration_s_; }
  int source_vertices() const { return source_vertices_; }  // of one of its frames
  StageSums stage_sums() const;

 private:
  void Publish(double warp_frames);

  const int source_vertices_;
  store::TemporaryFolder folder_;
  std::unique_ptr<store::Catalog> catalog_;
  std::unique_ptr<store::BlobStore> blobs_;
  catalog::Families families_;
  std::unique_ptr<rpc::Server> server_;
  double duration_s_ = 0.0;
};

}  // namespace liquidblend::bench
