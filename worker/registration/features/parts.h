// Parts: connected pieces of the liquid's surface from frame to frame, found in the space-time
// mesh. Internal to worker/registration.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Directions in which the reach of a part is measured.
inline constexpr std::array<std::array<int, 3>, 6> kReachDirections = {
    {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};

// A connected part of the surface within one slab, the time between two frames. Registration units.
struct Part {
  int slab = 0;        // times [slab - 1, slab)
  int32_t number = 0;  // its place among the graph's parts
  int64_t num_vertices = 0;
  Eigen::Vector4d centre = Eigen::Vector4d::Zero();  // mean of its vertices
  std::array<double, 6> reach = {};  // furthest vertex from the centre in each of kReachDirections
  double radius() const { return *std::max_element(reach.begin(), reach.end()); }
  double volume = 0.0;  // mean over the slab; of a bubble below 0
};

// An edge of the graph of parts: two parts that touch from one slab to a later one.
struct PartLink {
  int32_t from;  // the earlier part
  int32_t to;
  bool operator==(const PartLink&) const = default;
  auto operator<=>(const PartLink&) const = default;  // NOLINT(modernize-use-nullptr)
};

struct PartGraph {
  std::vector<Part> parts;       // by slab, then by lowest vertex
  std::vector<PartLink> links;   // ascending
  std::vector<int32_t> part_of;  // per vertex; -1: of a rigid piece
};

// Droplets that are carried as rigid pieces are left out.
// Cost: O(vertices + cells), nearly.
PartGraph FindParts(const Surface& surface);

}  // namespace liquidblend::registration
