// Files of a simulation -> Animation. Checks everything, names what is wrong.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/animation.h"
#include "core/parallel/arena.h"

namespace liquidblend::ingest {

enum class Format { kAny, kMantaflow, kPly, kObj };

// How the files' numbers become metres and seconds; 0 means: from meta.json among the files, or,
// where that is silent too, the default.
struct ImportOptions {
  Format format = Format::kAny;    // kAny: found from the file names
  double frames_per_second = 0.0;  // > 0; default 24
  double vertex_scale = 0.0;       // > 0; metres per unit of the files' positions; default 1
  double velocity_scale = 0.0;     // > 0; metres per second per unit of the files' velocities
  double voxel_size_m = 0.0;       // > 0; Mantaflow: velocity_scale is voxel_size_m * 2.5
  absl::Status Validate() const;   // names the first field out of range, and its value
};

struct InputFile {
  std::string name;                  // base name
  std::span<const std::byte> bytes;  // valid during the call
};

// Reads one animation. Frames are ordered by the number in their names, which must be consecutive.
// A frame that is not a closed, oriented manifold of finite numbers is refused; zero-area triangles
// and slivers are cleaned, which Animation::notes says.
// Errors: kInvalidArgument or kDataLoss; the message names file, frame and element.
// Threads: safe, same bytes for any thread count.
// Memory: at most a stated multiple of the files' size, also for hostile input (see the .cc).
absl::StatusOr<mesh::Animation> ReadAnimation(const std::string& name,
                                              std::span<const InputFile> files,
                                              const ImportOptions& options,
                                              const parallel::Arena& arena,
                                              const std::function<void(double)>& progress = {});

}  // namespace liquidblend::ingest
