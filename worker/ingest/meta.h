// meta.json: units, times and the upward direction of the files.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/up.h"

namespace liquidblend::ingest {

// Values of meta.json; 0 for keys that are missing.
struct Meta {
  double frames_per_second = 0.0;    // fps
  double longest_side_m = 0.0;       // largest of domain_size_m
  double voxel_size_m = 0.0;         // voxel_size_m
  double vertex_scale = 0.0;         // units.vertex_scale
  double velocity_scale = 0.0;       // units.velocity_scale_to_m_per_s
  std::vector<double> frame_times;   // frame_times: frames since the first, one per frame
  mesh::Up up = mesh::Up::kUnknown;  // up: "x", "y", "z", "-x", "-y" or "-z"
  mesh::Up up_against_gravity = mesh::Up::kUnknown;  // gravity, if it points along an axis
  // units.vertices in quotes, if it is not metres. If it is metres, vertex_scale is 1.
  std::string unit_of_vertices;
};

// docs/formats.md, "meta.json", lists all keys. Some are for information only and are not read.
// Errors: kInvalidArgument if the file is larger than 64 KiB, not a JSON object, or has a key that
// is not listed; if units is not a JSON object, a number above is not finite and above 0, the times
// do not rise from 0, or up is none of its six values; the message names the key. Memory: at most
// 80 times the file.
absl::StatusOr<Meta> ReadMeta(std::span<const std::byte> bytes);

}  // namespace liquidblend::ingest
