// Pre-roll: frames made up before the source's first one. A part of the liquid that is joined with
// the rest there, and apart in a target's first frame, is apart in them. So the source's surface
// can separate from it in blends, which keep the source's connections.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/mesh/space_time_mesh.h"
#include "core/mesh/triangle_mesh.h"
#include "core/mesh/up.h"
#include "core/parallel/arena.h"

namespace liquidblend::registration {

// Number of frames of a pre-roll. In them the fit can follow the fall of the target's part.
inline constexpr int kPreRollFrames = 8;

// Part that is cut off in the pre-roll.
struct CutPart {
  mesh::TriangleMesh surface;                        // metres; where the pre-roll shows it
  Eigen::Vector3d rise_m = Eigen::Vector3d::Zero();  // by which it was raised, clear of the rest
};

// Surface that all frames of a pre-roll show: the source's first frame, with the joined parts cut
// off, and in their place those of the targets, raised clear of the rest.
struct PreRoll {
  mesh::TriangleMesh surface;  // closed; metres
  std::vector<CutPart> parts;
  double gap_m = 0.0;  // air below each part, at least
};

// Smallest part that is cut off, in mean edge lengths of the source's first frame.
struct SmallestPart {
  double diameter_edges = 4.0;  // of a ball of the same volume; those of which tracks are made
  double area_edges2 = 0.0;     // those that are not carried as droplets
};

// Finds the pre-roll of a source. Nothing if no part is to be cut off, the surface cannot be cut
// cleanly, or a raised part has no room.
//   source, targets  first frames, closed; metres
// Velocities are kept if the source has them; the parts that were cut off rest.
// Cost: O(n log n) in the size of each first frame.
std::optional<PreRoll> FindPreRoll(const mesh::TriangleMesh& source,
                                   std::span<const mesh::TriangleMesh> targets, mesh::Up up,
                                   const SmallestPart& smallest);

// Moves the vertices of the parts back down to where they are joined with the rest. There they
// intersect it, but times before the first frame are shown in blends alone, where a part is as much
// higher as the target weighs.
//   mesh  of the source with the pre-roll
// Threads: same bytes for any thread count.
void LowerParts(const PreRoll& pre_roll, const parallel::Arena& arena, mesh::SpaceTimeMesh& mesh);

}  // namespace liquidblend::registration
