// Slices of a family, smoothed in time or not, with or without velocities.
#pragma once

#include <gtest/gtest.h>

#include <span>
#include <utility>
#include <vector>

#include "core/mesh/registered_family.h"
#include "core/mesh/triangle_mesh.h"
#include "server/blend/blend.h"
#include "server/finish/smooth_in_time.h"
#include "server/finish/time_links.h"
#include "server/finish/velocities.h"
#include "server/slice/slice.h"

namespace liquidblend::finish {

class Slicer {
 public:
  explicit Slicer(mesh::RegisteredFamily registered)
      : family_(std::move(registered)), index_(family_), links_(family_) {}

  const mesh::RegisteredFamily& family() const { return family_; }

  mesh::TriangleMesh Cut(const std::vector<double>& weights, double frame,
                         const TemporalOptions& temporal = {}) {
    const double time_s = std::min(frame / family_.frames_per_second, family_.duration_s());
    const absl::Status found = slice::FindCandidates(index_, weights, time_s, workspace_);
    EXPECT_TRUE(found.ok()) << found;
    blend::BlendVertices(family_, weights, workspace_.vertex_ranges, positions_);
    if (temporal.strength == 0.0) return slice::March(index_, positions_, workspace_);
    FindTimeNeighbors(links_, workspace_.vertex_ranges, temporal_);
    blend::BlendVertices(family_, weights, temporal_.vertex_ranges, wide_positions_);
    SmoothInTime(links_, wide_positions_, workspace_.vertex_ranges, temporal, temporal_,
                 smooth_positions_);
    return slice::March(index_, smooth_positions_, workspace_);
  }

  // Of the surface that was cut last.
  void AddVelocitiesTo(mesh::TriangleMesh& surface) const {
    const auto count = static_cast<size_t>(surface.num_vertices());
    const CrossedEdges crossed{
        workspace_.vertex_ranges, positions_, std::span(workspace_.near_vertex).first(count),
        std::span(workspace_.far_vertex).first(count), workspace_.time_frames};
    AddVelocities(family_, crossed, surface);
  }

 private:
  const mesh::RegisteredFamily family_;
  const slice::CellIndex index_;
  const TimeLinks links_;
  slice::Workspace workspace_;
  TemporalWorkspace temporal_;
  std::vector<mesh::Float4> positions_;
  std::vector<mesh::Float4> wide_positions_;
  std::vector<mesh::Float4> smooth_positions_;
};

}  // namespace liquidblend::finish
