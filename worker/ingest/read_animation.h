// Files of a simulation -> Animation. All input is checked; messages name the element at fault.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"

namespace liquidblend::ingest {

// kMantaflow: NAME_####.bobj.gz and, for all frames or none, lVelMesh_####.uni.
// kPly: NAME####.ply, binary of either byte order or ascii; vx vy vz optional.
// kObj, kStl: NAME####.obj, NAME####.stl (binary or ascii); no velocities.
// kVdb: NAME####.vdb; a float grid that is a level set and, optionally, a vector grid of
// velocities.
enum class Format { kAny, kMantaflow, kPly, kObj, kStl, kVdb };

// Units of the files and choice of frames; 0 means: from meta.json among the files (fps,
// units.vertex_scale, units.velocity_scale_to_m_per_s, voxel_size_m and, for Mantaflow, the longest
// of domain_size_m as vertex_scale), or, if it is missing there too, the default.
struct ImportOptions {
  Format format = Format::kAny;    // kAny: found from the file names
  double frames_per_second = 0.0;  // in mesh::kFramesPerSecond; default 24
  double vertex_scale = 0.0;       // > 0; metres per unit of the files' positions; default 1
  double velocity_scale = 0.0;     // > 0; metres per second per unit of the files' velocities;
                                   // default vertex_scale, for Mantaflow see voxel_size_m
  double voxel_size_m = 0.0;       // > 0; Mantaflow: velocity_scale is voxel_size_m * 2.5, and one
                                   // of the two must be known if there are velocities
  bool allow_gaps = false;         // frame numbers may be missing; time goes on across the gap
  // Frames since the first, one per frame, rising from 0; empty: from meta.json (frame_times), else
  // from the numbers in the names.
  std::vector<double> frame_times = {};
  // kUnknown: from meta.json (up, or against gravity), else Animation::up is kUnknown, too.
  mesh::Up up = mesh::Up::kUnknown;
  // Frames of such names only (base/glob.h), and their velocities; empty: all.
  std::string pattern = {};
  absl::Status Validate() const;  // names the first field out of range, and its value
};

struct InputFile {
  std::string name;                  // base name
  std::span<const std::byte> bytes;  // valid during the call
};

// Whether ReadAnimation reads a file of this name: meta.json, or one of a known format.
bool IsInputName(absl::string_view name);

// Reads one animation. Frames are ordered by the number before the extension, from any first one;
// numbers may have fractions (NAME0012.5.ply) and are times then; of whole ones none may be missing
// unless options.allow_gaps or the times are given. Other files are ignored. A frame that is not a
// closed, oriented surface of finite numbers with positive volume is refused; a frame without
// triangles is read as such: the liquid has left the domain. Zero-area triangles and slivers are
// cleaned, loose corners welded, pinched vertices split, parts that touch along non-manifold edges
// taken apart, parts that are inside out turned. Animation::notes lists these repairs; frames are
// manifolds then.
//   progress  called with the share of frames that are read, rising; one call at a time, from any
//             thread of the arena
// Errors: kInvalidArgument or kDataLoss, for the lowest frame at fault; the message names frame,
// file and element, vertices and faces counted from 0.
// Threads: safe, same bytes for any thread count.
// Memory, hostile input included: at most 16 MiB a thread, 192 bytes for each byte of PLY, OBJ and
// STL, 512 for each byte of gzip and VDB; about 10 for each byte of ordinary files.
absl::StatusOr<mesh::Animation> ReadAnimation(const std::string& name,
                                              std::span<const InputFile> files,
                                              const ImportOptions& options,
                                              const parallel::Arena& arena,
                                              const std::function<void(double)>& progress = {});

}  // namespace liquidblend::ingest
