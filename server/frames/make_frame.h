// A loaded family, weights and a time -> one encoded frame. Start reading the server here.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/object_pool.h"
#include "core/frames/make_surface.h"
#include "core/mesh/triangle_mesh.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/catalog/families.h"
#include "server/encode/surface_writer.h"
#include "server/metrics/metrics.h"

namespace liquidblend::server {

// Query of one frame of a family, complete.
struct FrameQuery {
  std::vector<double> weights;   // one per target, each in [-1, 2]
  bool is_extrapolated = false;  // weights of a point outside of the hull in parameter space
  bool is_clamped = false;       // weights that were moved by blend::LifeLimits
  double time_s = 0.0;           // [0, duration_s]
  v1::Encoding encoding;         // as CheckEncoding() takes it
  v1::SurfaceOptions surface;
};

// Buffers and workspaces that are reused from frame to frame. Used by one call at a time.
struct FrameBuffers {
  frames::SurfaceBuffers surface;
  encode::SurfaceWriter writer;
  metrics::StageTimes times;  // of the last frame
};

using FrameBufferPool = base::ObjectPool<FrameBuffers>;

// Checks the query's weights, encoding and surface options; the violation names the field. For
// early errors.
absl::Status CheckQuery(const catalog::LoadedFamily& loaded, const FrameQuery& query);

// Expected cost of the frame: cells of the level per frame of the animation; other stages count as
// the cells that take as long. At least 1. Requires: CheckQuery().ok().
int64_t ExpectedCells(const catalog::LoadedFamily& loaded, const FrameQuery& query);

// Makes one frame: blends, slices, finishes and encodes it. Errors: kInvalidArgument (weights,
// encoding, surface), kOutOfRange (time), each with the field's name; kCancelled soon after
// buffers.surface.stop has become true. Threads: safe with buffers of one's own; same bytes for the
// same family version and query.
absl::StatusOr<v1::Frame> MakeFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                                    FrameBuffers& buffers);

// Sets the smallest box around the surface. Requires: it has vertices.
void SetBounds(const mesh::TriangleMesh& surface, v1::Bounds& bounds);

// Counts in `metrics` a frame that was just made with `buffers`.
void CountFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                const v1::Frame& frame, const FrameBuffers& buffers, metrics::Metrics& metrics);

}  // namespace liquidblend::server
