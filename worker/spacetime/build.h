// Animation -> SpaceTimeMesh (paper, section 4), for any mesh sequence: from time links where
// frames share their connectivity, else as space-time surface nets (docs/architecture.md).
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/mesh/option_ranges.h"
#include "core/mesh/space_time_mesh.h"
#include "core/parallel/arena.h"

namespace liquidblend::spacetime {

// Connectivity of an animation's frames.
enum class Connectivity {
  kAuto,     // tracked if 85 % of the moving triangles meet one of the next frame
  kTracked,  // frames share it, wholly or mostly
  kRebuilt,  // each frame has its own
};

// Options of building a space-time mesh.
struct BuildOptions {
  Connectivity connectivity = Connectivity::kAuto;
  // Of rebuilt animations only:
  double spacing_edges =
      mesh::kDefaultSpacingEdges;    // [0.25, 4]; grid spacing h in mean edge lengths
  double max_motion_spacings = 3.0;  // >= 0.5; where the surface moves further from frame to frame,
                                     // there are layers in between
  double droplet_vertices = 150;     // [0, 10000]; smaller components are carried as rigid pieces;
                                     // a vertex has the area of one in a regular mesh
  // Builds as if all edges were this many times as long, so with fewer and larger cells: for a
  // first, coarse registration. [1, 32]; a tracked animation has no coarser mesh and takes 1 only.
  double edge_scale = 1.0;
  // Sheets thinner than the spacing stay whole instead of tearing (sheet_points.h). At rims and
  // where such a sheet moves fast, a few flakes of it may then be inside out.
  bool keep_thin_sheets = true;
  // Of all animations: sheets up to this thickness are flagged; [0, 16] mean edge lengths, 0: none
  double sheet_thickness_edges = 1.5;
  absl::Status Validate() const;  // names the first field out of range, and its value
  // The area of a component that is just not carried as a droplet, in squared mean edge lengths.
  double DropletArea() const;
};

// Chooses the connectivity that Build() assumes: kTracked or kRebuilt. Errors, Threads: as Build.
// Cost: of MatchedShare (build_tracked.h) if it is to choose.
absl::StatusOr<Connectivity> ChooseConnectivity(const mesh::Animation& animation,
                                                const BuildOptions& options,
                                                const parallel::Arena& arena);

// Builds the cell complex; its slice at frame k lies on frame k's surface.
// Requires: frames closed and oriented.  Errors: kInvalidArgument (options, fewer than 2 frames, no
// triangles at all, beyond core/mesh/animation_limits.h); base::MemoryLimitError() if the grid is
// larger than its index type or the remaining memory allows.
// Threads: safe, same bytes for any thread count.
absl::StatusOr<mesh::SpaceTimeMesh> Build(const mesh::Animation& animation,
                                          const BuildOptions& options, const parallel::Arena& arena,
                                          const std::function<void(double)>& progress = {});

}  // namespace liquidblend::spacetime
