#include "core/finish/time_links.h"

#include <array>
#include <cmath>
#include <limits>

namespace liquidblend::finish {
namespace {

using mesh::Float4;

// Parallel edges are time edges if all have the same direction in time and this mean length or
// more. Between two frames the mean is about 1; in cells that are flat in time the edges have any
// length, in both directions.
constexpr float kMinMeanStep = 0.2F;  // frames

template <size_t kEdges>
using ParallelEdges = std::array<std::array<int, 2>, kEdges>;  // corners of a cell

constexpr std::array<ParallelEdges<4>, 3> kHexahedronEdges = {{{{{0, 1}, {2, 3}, {4, 5}, {6, 7}}},
                                                               {{{0, 2}, {1, 3}, {4, 6}, {5, 7}}},
                                                               {{{0, 4}, {1, 5}, {2, 6}, {3, 7}}}}};
constexpr ParallelEdges<3> kWedgeEdges = {{{0, 3}, {1, 4}, {2, 5}}};

class Linker {
 public:
  Linker(const mesh::RegisteredFamily& family, std::vector<int32_t>& earlier,
         std::vector<int32_t>& later)
      : vertices_(family.vertices),
        frames_(FramesOf(family)),
        earlier_(earlier),
        later_(later),
        earlier_sq_(vertices_.size(), std::numeric_limits<float>::infinity()),
        later_sq_(earlier_sq_) {}

  // The mean time from the first to the second corners if all have one sign, else 0.
  template <typename Cell, size_t kEdges>
  float MeanStep(const Cell& cell, const ParallelEdges<kEdges>& edges) const {
    float sum = 0.0F;
    float least = std::numeric_limits<float>::infinity();
    float most = -least;
    for (const auto& [a, b] : edges) {
      const float step = frames_[cell[b]] - frames_[cell[a]];
      sum += step;
      least = std::min(least, step);
      most = std::max(most, step);
    }
    const bool is_one_way = least > 0.0F || most < 0.0F;
    return is_one_way ? sum / static_cast<float>(kEdges) : 0.0F;
  }

  template <typename Cell, size_t kEdges>
  void LinkAlong(const Cell& cell, const ParallelEdges<kEdges>& edges, float step) {
    if (std::abs(step) < kMinMeanStep) return;
    for (const auto& [a, b] : edges) {
      if (step > 0.0F) {
        Link(cell[a], cell[b]);
      } else {
        Link(cell[b], cell[a]);
      }
    }
  }

 private:
  static std::vector<float> FramesOf(const mesh::RegisteredFamily& family) {
    const mesh::TimeAxis axis = family.time_axis();
    std::vector<float> frames;
    frames.reserve(family.vertices.size());
    for (const Float4& v : family.vertices) {
      frames.push_back(static_cast<float>(axis.Frames(v[3])));
    }
    return frames;
  }

  void Link(int32_t before, int32_t after) {
    float length_sq = 0.0F;
    for (int k = 0; k < 3; ++k) {
      const float d = vertices_[after][k] - vertices_[before][k];
      length_sq += d * d;
    }
    if (length_sq < later_sq_[before]) {
      later_sq_[before] = length_sq;
      later_[before] = after;
    }
    if (length_sq < earlier_sq_[after]) {
      earlier_sq_[after] = length_sq;
      earlier_[after] = before;
    }
  }

  std::span<const Float4> vertices_;
  const std::vector<float> frames_;  // when each vertex is
  std::vector<int32_t>& earlier_;
  std::vector<int32_t>& later_;
  std::vector<float> earlier_sq_;  // squared length of the link in space
  std::vector<float> later_sq_;
};

}  // namespace

TimeLinks::TimeLinks(const mesh::RegisteredFamily& family)
    : axis_(family.time_axis()),
      earlier_(family.vertices.size(), -1),
      later_(family.vertices.size(), -1) {
  Linker linker(family, earlier_, later_);
  for (const mesh::Hexahedron& cell : family.hexahedra) {
    std::array<float, 3> steps;
    int longest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      steps[axis] = linker.MeanStep(cell, kHexahedronEdges[axis]);
      if (std::abs(steps[axis]) > std::abs(steps[longest])) longest = axis;
    }
    linker.LinkAlong(cell, kHexahedronEdges[longest], steps[longest]);
  }
  for (const mesh::Wedge& cell : family.wedges) {
    linker.LinkAlong(cell, kWedgeEdges, linker.MeanStep(cell, kWedgeEdges));
  }
}

int64_t TimeLinks::size_bytes() const {
  return static_cast<int64_t>((earlier_.capacity() + later_.capacity()) * sizeof(int32_t));
}

}  // namespace liquidblend::finish
