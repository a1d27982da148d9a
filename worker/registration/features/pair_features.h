// Pairing of the features of two animations. Internal to worker/registration.
#pragma once

#include <vector>

#include "worker/registration/features/assignment.h"
#include "worker/registration/features/extrema.h"
#include "worker/registration/features/lumps.h"
#include "worker/registration/features/obstacles.h"
#include "worker/registration/features/tracks.h"

namespace liquidblend::registration {

// Features of one animation; registration units.
struct Features {
  std::vector<Track> tracks;             // by start time
  std::vector<Extremum> extrema;         // as FindExtrema() says
  std::vector<Obstacle> obstacles = {};  // as FindObstacles() says
  std::vector<int32_t> track_of = {};    // per vertex; -1: of none
  std::vector<Lump> lumps = {};          // as FindLumps() says
  mesh::Up up = mesh::Up::kUnknown;
};

// Units for differences of features.
struct SceneScale {
  double length = 1.0;  // > 0; mean edges: diagonal of the box around both animations
  double frames = 1.0;  // > 0; from the first frame to the last
};

SceneScale ScaleOf(const Surface& source, const Surface& target);

// Limits of the differences within a pair, as shares of SceneScale.
struct PairOptions {
  double max_shift = 0.75;        // between two tracks from the first frame on, at start and end
  double max_lead = 0.6;          // between their lives
  double max_volume_ratio = 6.0;  // >= 1; of all tracks
  // Between all other features, relative to the merges of those tracks.
  double max_event_shift = 0.12;
  double max_event_lead = 0.12;
  double max_persistence_ratio = 2.0;  // >= 1
  double max_obstacle_shift = 0.5;     // between the middles of two obstacles
  double max_obstacle_ratio = 2.5;     // >= 1; of their diagonals
  double min_confidence = 0.5;         // [0, 1]; only surer pairs are kept
  // Two of the tracks that begin at the first frame exchange their partners, where that costs
  // least: another way to pair them.
  bool exchange = false;
};

// Parts that are detached in the first frame of one animation and joined with the rest in the
// other's: the source's, and the target's.
struct JoinedTracks {
  std::vector<JoinedTrack> source, target;
};
JoinedTracks FindJoinedTracks(const Features& source, const Features& target,
                              const SceneScale& scale, const PairOptions& options = {});

struct FeaturePairs {
  std::vector<AssignedPair> tracks;   // row: source's, column: target's
  std::vector<AssignedPair> extrema;  // likewise, into Features::extrema
  std::vector<AssignedPair> obstacles = {};
  JoinedTracks joined = {};  // these tracks have no partner
};

// Pairs first the tracks that begin at the first frame, of like volume, place and life: the
// assignment of least squared differences over all of them, so that two drops that are moved the
// same way do not swap their partners. A track whose lump is joined with the rest in the other
// animation has no partner. Then later tracks (splashes) and extrema, by their places
// and times relative to the merges of the first pairs. Pairs of extrema that go against the order
// in time of those merges, or of surer pairs, are dropped. Obstacles by place and size. Only the
// strongest kMaxAssigned features of each kind take part.
FeaturePairs PairFeatures(const Features& source, const Features& target, const SceneScale& scale,
                          const PairOptions& options = {});

}  // namespace liquidblend::registration
