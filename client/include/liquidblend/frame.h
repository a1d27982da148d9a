// One frame of a blend: what is asked for, and what comes back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "liquidblend/bounds.h"

namespace liquidblend {

struct FrameRequest {
  std::string family;           // the id, with or without "families/"
  std::vector<double> weights;  // one per target; the source gets 1 - sum; [-1, 2]
  double time_s = 0.0;          // [0, duration_s]
  int position_bits = 0;        // 8 to 20; 0: the server's default
  int64_t version = 0;          // 0: the latest
};

struct Frame {
  std::string data;  // a Draco mesh: see decode.h
  std::string family;
  int64_t version = 0;
  std::vector<double> weights;
  double time_s = 0.0;
  int64_t num_vertices = 0;
  int64_t num_triangles = 0;
  Bounds bounds;
};

}  // namespace liquidblend
