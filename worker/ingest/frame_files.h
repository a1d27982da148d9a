// Selection of the frames among files, and their order.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::ingest {

struct FrameFiles {
  double number = 0.0;  // as in the name: 12, or 12.5 for a sample between frames
  const InputFile* mesh = nullptr;
  const InputFile* velocities = nullptr;  // Mantaflow's; or none
};

struct FrameSequence {
  Format format = Format::kAny;     // never kAny in a result
  const InputFile* meta = nullptr;  // or none
  std::vector<FrameFiles> frames;   // numbers rising; at least one
  bool has_fractions = false;       // numbers need not be whole
};

// The result points into `files`. `pattern`, unless it is empty, chooses frames by their names
// (base/glob.h), and the velocities of those. A number is the digits before the extension. It has a
// fraction (mesh_0012.5.ply) where the digits before the dot count frames: they are not the same in
// all names, as in run2.0001.ply. Errors: kInvalidArgument if no file has a known format or the
// files have several, a name has no number, a number comes twice, names differ by more than their
// numbers, or velocities have no mesh. client/src/frame_names.h applies the same rules before an
// upload.
absl::StatusOr<FrameSequence> FindFrames(std::span<const InputFile> files, Format format,
                                         const std::string& pattern = "");

// Checks that numbers with a dot can be times. They are not if they are those of two sequences, as
// in run1.01.ply, run1.02.ply, run2.01.ply and run2.02.ply. Several numbers after a dot that come
// with different ones before it are times only if they cut a frame into equal parts (.25, .5, .75),
// and not into tenths or hundredths. Nor are those times that go up by one in several runs, as in
// run1.01.ply, run1.02.ply, run2.03.ply and run2.04.ply, unless all are evenly spaced. Errors:
// kInvalidArgument with a file of each. client/src/frame_names.h applies the same rules.
absl::Status CheckFractions(const FrameSequence& sequence);

// A file's name, and a number of a frame, for messages.
std::string Escaped(const InputFile& file);
std::string FormatNumber(double number);

}  // namespace liquidblend::ingest
