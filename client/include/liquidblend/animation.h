// Animations on the server. Times are seconds, positions metres, velocities metres per second, in
// the world that the animations were imported from.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/bounds.h"
#include "liquidblend/up.h"

namespace liquidblend {

// kAny: found from the file names
enum class AnimationFormat { kAny, kMantaflow, kPly, kObj, kStl, kVdb };
enum class AnimationState { kUnknown, kImporting, kReady, kFailed };

// Units of the files and choice of frames; 0 means: from meta.json beside the frames.
struct ImportOptions {
  AnimationFormat format = AnimationFormat::kAny;
  double frames_per_second = 0.0;   // >= 0
  double vertex_scale = 0.0;        // >= 0; metres per unit of the files' positions
  double velocity_scale = 0.0;      // >= 0; metres per second per unit of the files' velocities
  double voxel_size_m = 0.0;        // >= 0; Mantaflow: gives velocity_scale = voxel_size_m * 2.5
  bool allow_gaps = false;          // frame numbers may be missing; time goes on across the gap
  std::vector<double> frame_times;  // frames since the first, one per frame, rising from 0; empty:
                                    // from meta.json, else from the numbers in the names
  Up up = Up::kUnknown;  // kUnknown: from meta.json, else found from parts that fall, else z
  // Pattern of the frames' names, as "foam.*", which chooses their velocities, too; empty: all.
  // Applied by the server; for uploads, ListAnimationFiles() applies it before.
  std::string pattern;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

struct Animation {
  std::string name;  // animations/{id}
  AnimationState state = AnimationState::kUnknown;
  absl::Status error;  // kFailed: why
  int num_frames = 0;
  int first_frame_number = 0;
  double frames_per_second = 0.0;
  Up up = Up::kUnknown;  // as given, or as falling parts show it; kUnknown: z is assumed
  double mean_edge_length_m = 0.0;
  int64_t num_vertices = 0;   // over all frames
  int64_t num_triangles = 0;  // over all frames
  Bounds bounds;              // of all frames
  int64_t size_bytes = 0;
  std::vector<std::string> notes;  // cleaned or assumed on import, a sentence each
  absl::Time create_time = absl::UnixEpoch();
  std::string json;  // all of that in protobuf's JSON of liquidblend.v1.Animation
};

}  // namespace liquidblend
