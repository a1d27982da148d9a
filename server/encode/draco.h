// A triangle surface as a standard Draco mesh.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/frames/grid.h"
#include "core/mesh/triangle_mesh.h"
#include "server/encode/surface_writer.h"

namespace liquidblend::encode {

// Trade-off between time and bytes. All presets give the same triangles on the same grid.
enum class Preset : uint8_t {
  kFastest,   // standard Edgebreaker, parallelogram prediction
  kBalanced,  // valences as contexts, more precise probabilities
  kSmallest,  // several parallelograms for each vertex, by libdraco, where that is fewer bytes
};

// Options of a Draco mesh.
struct DracoOptions {
  Preset preset = Preset::kFastest;
  int position_bits = 14;         // [frames::kMinPositionBits, frames::kMaxPositionBits]
  frames::Grid grid;              // finite; of the family
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// Metadata "name" of the GENERIC attributes that hold velocities and rest positions.
inline constexpr char kVelocityName[] = "velocity";
inline constexpr char kRestName[] = "rest";

// Encodes a surface as a Draco mesh: a POSITION attribute (metres) and Edgebreaker connectivity. If
// the mesh has them, it writes normals as a NORMAL attribute (10 bits, octahedral) and velocities
// as a GENERIC one of three floats (m/s, 14 bits of the frame's range) whose metadata has the name
// above; likewise rest positions, four floats (16 bits of the frame's range).
// Positions are rounded to the grid: off by at most half a step, except those outside of the grid,
// which are moved onto its border first. The triangles stay, but their order and that of the
// vertices do not; a vertex where the surface touches itself may become several. Triangles that
// name a vertex twice and vertices of no triangle are left out. A mesh without triangles gives a
// valid Draco mesh without triangles and points.
// Errors: kInvalidArgument (options; indices out of range or numbers not finite, naming the
// element), kInternal (libdraco's message).
//   helpers  threads that may help while they are idle, or null
// Threads: safe with a writer per caller, same bytes always.  Cost: at kFastest and kBalanced about
// 0.04 us per triangle of a closed surface of positions alone, otherwise libdraco's 0.1 to 0.5.
absl::StatusOr<std::string> EncodeDraco(const mesh::TriangleMesh& mesh, const DracoOptions& options,
                                        SurfaceWriter& writer,
                                        parallel::Helpers* helpers = nullptr);

// The same with a writer for this call only, which costs the time to allocate its memory.
absl::StatusOr<std::string> EncodeDraco(const mesh::TriangleMesh& mesh,
                                        const DracoOptions& options);

}  // namespace liquidblend::encode
