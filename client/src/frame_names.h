// Base names of the files of an upload: whether they make one sequence of frames. Imports look for
// the same (worker/ingest/frame_files.h, frame_times.h); here it costs no upload.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "liquidblend/animation.h"

namespace liquidblend::client {

// Whether it is the mesh of a frame.
bool IsFrameName(const std::string& name);

// Whether files of this name belong to an animation: frames, *.uni and meta.json.
bool IsAnimationFileName(const std::string& name);

// What the numbers in the names must be.
enum class NumberRule {
  kNoGaps,
  kGapsAllowed,
  kTimesGiven,  // when the frames are is said elsewhere: numbers give the order alone
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
