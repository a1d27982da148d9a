// meta.json: what the files' numbers mean.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/up.h"

namespace liquidblend::ingest {

// 0 where the file is silent.
struct Meta {
  double frames_per_second = 0.0;    // fps
  double longest_side_m = 0.0;       // largest of domain_size_m
  double voxel_size_m = 0.0;         // voxel_size_m
  double vertex_scale = 0.0;         // units.vertex_scale
  double velocity_scale = 0.0;       // units.velocity_scale_to_m_per_s
  std::vector<double> frame_times;   // frame_times: frames since the first, one per frame
  mesh::Up up = mesh::Up::kUnknown;  // up: "x", "y", "z", "-x", "-y" or "-z"
  mesh::Up up_against_gravity = mesh::Up::kUnknown;  // gravity, if it points along an axis
  // units.vertices in quotes, if it does not say metres; where it does, vertex_scale is 1.
  std::string unit_of_vertices;
};

// docs/formats.md, "meta.json", lists all keys. Some are for the record only and are not looked at.
// Errors: kInvalidArgument if the file is larger than 64 KiB, no JSON object, has a key that is not
// listed, units is no JSON object, one of the numbers above is not finite and above 0, the times do
// not rise from 0, or up is none of its six; the message names the key. Memory: at most 80 times
// the file.
absl::StatusOr<Meta> ReadMeta(std::span<const std::byte> bytes);

}  // namespace liquidblend::ingest
