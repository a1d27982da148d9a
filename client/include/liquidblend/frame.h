// One frame of a blend: request and result.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "liquidblend/bounds.h"
#include "liquidblend/parameter_space.h"

namespace liquidblend {

enum class Smoothing {
  kTaubin,     // keeps volumes
  kLaplacian,  // the paper's; each pass shrinks small parts
};

// Processing of the slice by the server before encoding; the defaults leave it unchanged.
struct SurfaceOptions {
  int level_of_detail = 0;   // 0: the finest; at most the number of Family::coarser_levels
  int smoothing_passes = 0;  // 0 to 32; evens out triangles
  Smoothing smoothing = Smoothing::kTaubin;
  double smoothing_strength = 0.0;  // (0, 1]; 0: the server's default
  double temporal_smoothing = 0.0;  // [0, 1]; against flicker
  bool normals = false;             // in Mesh::normals
  bool velocities = false;          // in Mesh::velocities
  bool rest_positions = false;      // in Mesh::rest

  bool operator==(const SurfaceOptions&) const = default;
};

// Trade-off between time and bytes; the triangles and their positions are the same.
enum class EncodingPreset {
  kFastest,   // the server's default
  kBalanced,  // 10 to 25 % fewer bytes for a quarter more time
  kSmallest,  // 5 to 15 % fewer still for ten times the time
};

// Form of the data; the triangles and their positions are the same.
enum class FrameFormat {
  kDraco,    // the smallest
  kMeshopt,  // three to four times the bytes, decoded 18 times faster or more; up to 16 position
             // bits
};

struct FrameRequest {
  std::string family;           // the id, with or without "families/"
  std::vector<double> weights;  // one per target; the source gets 1 - sum; [-1, 2]
  // Instead of weights: a point in the family's parameter space. Outside of the hull of the
  // family's points it is refused (kOutOfRange), or extrapolated by the nearest simplex.
  Parameters parameters;
  bool extrapolate = false;
  double time_s = 0.0;    // [0, duration_s]
  int position_bits = 0;  // 8 to 20; 0: the server's default
  // Instead of position_bits: the longest step of the grid that positions are rounded to, metres.
  double position_step_m = 0.0;                        // 0: by position_bits
  EncodingPreset encoding = EncodingPreset::kFastest;  // of Draco
  FrameFormat format = FrameFormat::kDraco;
  int64_t version = 0;  // 0: the latest
  // The oldest acceptable version if `version` is 0; a server that has not loaded it yet does so
  // first. 0: the newest that the Client has got (Client::GetFamily, finished operations).
  int64_t min_version = 0;
  SurfaceOptions surface;
};

struct Frame {
  std::string data;  // for DecodeMesh(): see decode.h
  std::string family;
  int64_t version = 0;
  std::vector<double> weights;  // that were used, also for parameters
  bool extrapolated = false;    // the parameters lie outside of the hull
  bool clamped = false;         // other weights than asked for: a falling part would not fall
  double time_s = 0.0;
  int64_t num_vertices = 0;
  int64_t num_triangles = 0;
  Bounds bounds;
};

}  // namespace liquidblend
