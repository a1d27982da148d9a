// Check of the base names of an upload's files: whether they are one sequence of frames. Imports
// apply the same rules (worker/ingest/frame_files.h, frame_times.h); this check saves an upload.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "liquidblend/animation.h"

namespace liquidblend::client {

// Whether the name is of a frame's mesh.
bool IsFrameName(const std::string& name);

// Whether files of this name belong to an animation: frames, *.uni and meta.json.
bool IsAnimationFileName(const std::string& name);

// Rule for the numbers in the names.
enum class NumberRule {
  kNoGaps,
  kGapsAllowed,
  kTimesGiven,  // times are given elsewhere: numbers give the order alone
};

// Errors: kInvalidArgument, naming the files, if there are no frames or they are of several
// formats, a name has no number, names differ by more than their numbers, their numbers with a dot
// are those of two sequences (run1.01.ply, run2.01.ply), a number is missing or comes twice, or
// only some frames have velocities.
absl::Status CheckFrameNames(const std::vector<std::string>& names, AnimationFormat format,
                             NumberRule rule);

// The names without the velocities (lVelMesh_0001.uni) of frames that are not among them.
std::vector<std::string> WithoutStrayVelocities(const std::vector<std::string>& names);

}  // namespace liquidblend::client
