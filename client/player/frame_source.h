// Source of a family's frames: a server, or the family's file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/player/frame_pool.h"
#include "liquidblend/bounds.h"
#include "liquidblend/frame.h"
#include "liquidblend/parameter_space.h"
#include "liquidblend/up.h"

namespace liquidblend::player {

// What a family is.
struct FamilyFacts {
  std::string name;
  int64_t version = 0;               // 0: not known
  std::vector<std::string> targets;  // in the order of weights
  double duration_s = 0.0;
  double frames_per_second = 0.0;
  int num_levels = 1;  // of detail
  Up up = Up::kUnknown;
  Bounds bounds;
  ParameterSpace parameter_space;
};

// Blend of a frame: weights, one per target, or else a point in the family's parameter space.
struct BlendSpec {
  std::vector<double> weights;
  Parameters parameters;
  bool extrapolate = false;  // of a point outside of the hull

  bool operator==(const BlendSpec&) const = default;
};

// Request of one frame.
struct FrameSpec {
  BlendSpec blend;
  double time_s = 0.0;                         // [0, duration_s]
  SurfaceOptions surface;                      // with the level of detail
  int position_bits = 0;                       // [8, 16]; 0: 14
  FrameFormat format = FrameFormat::kMeshopt;  // on the wire
  bool is_exact = false;                       // worth waiting for, however long it takes

  bool operator==(const FrameSpec&) const = default;
};

// What getting a frame cost.
struct FrameCost {
  double wait_s = 0.0;    // for the server
  double decode_s = 0.0;  // or to make it
  int64_t num_bytes = 0;  // received
};

// Threads: safe.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const FamilyFacts& facts() const = 0;
  // Gets one frame; waits for it.
  // Errors: kInvalidArgument, kOutOfRange (the request, naming the field), kResourceExhausted (no
  // memory); of a server, also its others: kUnavailable if it cannot be reached.
  virtual absl::Status Get(const FrameSpec& spec, FramePool& pool, FrameMesh& out,
                           FrameCost& cost) = 0;
};

}  // namespace liquidblend::player
