// Slices of a family, smoothed in time or not, with or without velocities.
#pragma once

#include <gtest/gtest.h>

#include <optional>
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
    blender_.emplace(family_, weights);
    if (temporal.strength == 0.0) return slice::March(index_, *blender_, workspace_);
    return slice::March(index_, TimeSmoother(links_, *blender_, temporal, temporal_), workspace_);
  }

  // Of the surface that was cut last.
  void AddVelocitiesTo(mesh::TriangleMesh& surface) const {
    const auto count = static_cast<size_t>(surface.num_vertices());
    const auto near = std::span(workspace_.near_vertex).first(count);
    const auto far = std::span(workspace_.far_vertex).first(count);
    std::vector<mesh::Float4> near_positions(count);
    std::vector<mesh::Float4> far_positions(count);
    blender_->Place(near, near_positions.data());
    blender_->Place(far, far_positions.data());
    AddVelocities(family_, {near, far, near_positions, far_positions, workspace_.time_ticks},
                  surface);
  }

 private:
  const mesh::RegisteredFamily family_;
  const slice::CellIndex index_;
  const TimeLinks links_;
  slice::Workspace workspace_;
  TemporalWorkspace temporal_;
  std::optional<blend::Blender> blender_;  // of the surface that was cut last
};

}  // namespace liquidblend::finish
