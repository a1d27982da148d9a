// Which of the files are the frames, in which order.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::ingest {

struct FrameFiles {
  int number = 0;
  const InputFile* mesh = nullptr;
  const InputFile* velocities = nullptr;  // Mantaflow's; or none
};

struct FrameSequence {
  Format format = Format::kAny;     // never kAny in a result
  const InputFile* meta = nullptr;  // or none
  std::vector<FrameFiles> frames;   // numbers without gaps, rising; at least one
};

// The result points into `files`. Errors: kInvalidArgument if no file has a known format or several
// have, a name has no number, a number comes twice or is missing, or velocities without a mesh.
absl::StatusOr<FrameSequence> FindFrames(std::span<const InputFile> files, Format format);

// A file's name for messages.
std::string Shown(const InputFile& file);

}  // namespace liquidblend::ingest
