// Slices of a family, smoothed in time or not, with or without velocities.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/blend/blend.h"
#include "core/finish/rest_positions.h"
#include "core/finish/smooth_in_time.h"
#include "core/finish/time_links.h"
#include "core/finish/velocities.h"
#include "core/mesh/registered_family.h"
#include "core/mesh/triangle_mesh.h"
#include "core/slice/slice.h"

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
    blender_.emplace(family_, weights);
    if (temporal.strength == 0.0) return slice::March(index_, *blender_, workspace_);
    return slice::March(index_, TimeSmoother(links_, *blender_, temporal, temporal_), workspace_);
  }

  // Of the surface that was cut last.
  void AddVelocitiesTo(mesh::TriangleMesh& surface) {
    AddVelocities(family_, EdgesOf(surface), surface);
  }
  void AddRestPositionsTo(mesh::TriangleMesh& surface) {
    AddRestPositions(family_, EdgesOf(surface), surface);
  }

 private:
  CrossedEdges EdgesOf(const mesh::TriangleMesh& surface) {
    const auto count = static_cast<size_t>(surface.num_vertices());
    const auto near = std::span(workspace_.near_vertex).first(count);
    const auto far = std::span(workspace_.far_vertex).first(count);
    near_positions_.resize(count);
    far_positions_.resize(count);
    blender_->Place(near, near_positions_.data());
    blender_->Place(far, far_positions_.data());
    return {near, far, near_positions_, far_positions_, workspace_.time_ticks};
  }

  const mesh::RegisteredFamily family_;
  const slice::CellIndex index_;
  const TimeLinks links_;
  slice::Workspace workspace_;
  TemporalWorkspace temporal_;
  std::vector<mesh::Float4> near_positions_, far_positions_;
  std::optional<blend::Blender> blender_;  // of the surface that was cut last
};

}  // namespace liquidblend::finish
