// Tracks: parts of the liquid that are detached from the rest, such as falling drops and splashes,
// over their lives. Internal to worker/registration.
#pragma once

#include <vector>

#include "worker/registration/features/parts.h"

namespace liquidblend::registration {

enum class TrackStart { kFirstFrame, kSplit, kAppears };
enum class TrackEnd { kLastFrame, kMerge, kVanishes };

// One part while it lives. Registration units: lengths in mean edges, times in frames.
struct Track {
  TrackStart start = TrackStart::kFirstFrame;
  TrackEnd end = TrackEnd::kLastFrame;
  double start_time = 0.0;  // not negative, unless it ends before the first frame
  double end_time = 0.0;
  double volume = 0.0;      // median over its life
  std::vector<Part> parts;  // ascending in time, at least one
  // Whether it ends before the first frame: a part of the pre-roll (pre_roll.h).
  bool is_pre_roll() const { return end_time < 0; }
  double life() const { return end_time - start_time; }
  double diameter() const;  // of a ball of the same volume
  // The part as it is at a time of its life: centre and reach, between the slabs' means.
  Part At(double time) const;
};

struct TrackOptions {
  double min_diameter = 4.0;        // >= 0; edges; smaller ones are noise ...
  double min_life = 3.0;            // >= 0; ... and so are shorter ones, in frames, but for ...
  double min_first_life = 1.0;      // ... those that are there at the first frame
  double max_share = 0.6;           // [0, 1]; of the liquid's volume: larger parts are the body
  double dominant_share = 2.0 / 3;  // [0, 1]; where parts meet or divide, one this large goes on
  double max_gap = 3.0;             // frames; shorter contacts are ignored
};

// Finds all tracks within the limits, by start time, then by number of part. Where a part meets the
// rest or leaves it for a moment only, its track goes on.
// Cost: O(parts^2) at worst, in the number of merges and splits.
std::vector<Track> FindTracks(const PartGraph& graph, int num_frames,
                              const TrackOptions& options = {});

}  // namespace liquidblend::registration
