// A loaded family, weights and a time -> one encoded frame. Start reading the server here.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/registered_family.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/catalog/families.h"
#include "server/encode/surface_writer.h"
#include "server/finish/smooth_in_time.h"
#include "server/slice/slice.h"

namespace liquidblend::rpc {

struct FrameQuery {
  std::vector<double> weights;   // one per target, each in [-1, 2]
  bool is_extrapolated = false;  // weights of a point outside of the hull in parameter space
  double time_s = 0.0;           // [0, duration_s]
  v1::Encoding encoding;         // format DRACO or unset; position_bits 0 (14) or [8, 20]
  v1::SurfaceOptions surface;
};

// What is worth keeping from frame to frame. One per call at a time.
struct FrameBuffers {
  slice::Workspace workspace;
  std::vector<mesh::Float4> positions;  // as blended
  finish::TemporalWorkspace temporal;
  std::vector<mesh::Float4> wide_positions;    // with those a little earlier and later
  std::vector<mesh::Float4> smooth_positions;  // smoothed in time
  encode::SurfaceWriter writer;
};

// Checks the query's weights, encoding and surface options; the violation names the field. For
// errors before work.
absl::Status CheckQuery(const mesh::RegisteredFamily& family, const FrameQuery& query);

// Errors: kInvalidArgument (weights, encoding, surface), kOutOfRange (time), each with the field's
// name. Threads: safe with buffers of one's own; same bytes for the same family version and query.
absl::StatusOr<v1::Frame> MakeFrame(const catalog::LoadedFamily& loaded, const FrameQuery& query,
                                    FrameBuffers& buffers);

}  // namespace liquidblend::rpc
