// Lumps: bulges of the first frame's surface, seen from above. A drop is one whether it is apart or
// touches the pool already, so lumps can be paired where tracks cannot. Internal to
// worker/registration.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "core/mesh/triangle_mesh.h"
#include "core/mesh/up.h"
#include "worker/registration/features/assignment.h"
#include "worker/registration/features/tracks.h"
#include "worker/registration/surface/surface.h"

namespace liquidblend::registration {

// Registration units.
struct Lump {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  // middle; as PlaceOf() says (height_field.h)
  double height = 0.0;                              // of its top
  double prominence = 0.0;  // how far one has to go down on the way to a higher one
  double diameter = 0.0;    // of a disk as large as what is above half of its prominence
};

// Finds the lumps that stand out by `min_prominence` (edges), by grid point of their tops.
// Cost: O(cells), and O(n log n) in the first frame's size in square edges.
std::vector<Lump> FindLumps(const Surface& surface, double min_prominence);

// The same of a first frame in mean edges; none if it has no surface.
std::vector<Lump> FindLumps(const mesh::TriangleMesh& first_frame, const mesh::HeightAxis& up,
                            double min_prominence);

// Pairs lumps by place and size: the assignment of least squared differences.
//   max_shift  edges; further apart are no pair
// Of more than kMaxAssigned lumps the most prominent take part.
std::vector<AssignedPair> PairLumps(const std::vector<Lump>& source,
                                    const std::vector<Lump>& target, double max_shift);

// The tracks and the lumps of one animation.
struct TracksWithLumps {
  const std::vector<Track>& tracks;
  const std::vector<Lump>& lumps;
};

// A detached part whose lump has a sure partner in the other animation that belongs to no track
// there. Such a part is detached in one animation only. It has no counterpart among the detached
// parts of the other animation, even if one is similar.
struct JoinedTrack {
  int track;
  int own_lump;
  int other_lump;
  int pre_roll_track = -1;  // of the other animation: the same part, cut off; -1: none
};

inline bool IsJoined(const std::vector<JoinedTrack>& joined, int track) {
  return std::any_of(joined.begin(), joined.end(),
                     [track](const JoinedTrack& j) { return j.track == track; });
}

// The tracks of `own` that are joined with the rest in the other animation, ascending.
//   pairs  rows: own.lumps, columns: other.lumps
//   min_confidence  of a sure pair
std::vector<JoinedTrack> FindJoinedTracks(const TracksWithLumps& own, const TracksWithLumps& other,
                                          const std::vector<AssignedPair>& pairs, mesh::Up up,
                                          double min_confidence);

}  // namespace liquidblend::registration
