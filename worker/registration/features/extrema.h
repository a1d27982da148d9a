// Apexes and craters: extrema of the surface's height in space and time, such as tips of jets and
// bottoms of craters. Internal to worker/registration.
#pragma once

#include <vector>

#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

enum class ExtremumKind { kApex, kCrater };

// A vertex higher (lower) than all around it, in space and in time, by SpaceTimeMesh::up.
struct Extremum {
  ExtremumKind kind = ExtremumKind::kApex;
  Eigen::Vector4d point = Eigen::Vector4d::Zero();  // registration units
  // How far one has to go down (up) on the way to a higher (lower) one, or to the end of the
  // compared vertices; mean edge lengths.
  double persistence = 0.0;
};

struct ExtremaOptions {
  double min_persistence = 6.0;    // >= 0; edges; less is noise ...
  double min_height_share = 0.25;  // >= 0; ... and so is less than this of the scene's height
  double end_frames = 2.0;         // >= 0; so near to the ends of time it may be cut off
};

// Apexes, then craters, each the most persistent first. All vertices are compared for apexes, up to
// the ends of time, and those whose normals point up for craters; droplets carried as rigid pieces
// are left out. Cost: O(vertices log vertices + cells).
std::vector<Extremum> FindExtrema(const Surface& surface, const ExtremaOptions& options = {});

}  // namespace liquidblend::registration
