// Clients of all kinds, each a function that goes on until it is told to stop, on a thread of its
// own.
#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "liquidblend/v1/liquidblend.pb.h"
#include "tests/bench/machine_stops.h"

namespace liquidblend::bench {

struct LoadTarget {
  std::string address;
  std::string family;  // families/{id}
  int num_weights = 1;
  double duration_s = 0.0;
};

// What one client saw.
struct ClientReport {
  std::vector<double> latencies_ms;  // of calls; of streams: behind the pace of the first frame
  int64_t num_errors = 0;
  std::vector<Interval> late;  // of streams: from when a frame was due until it came, where that
                               // is more than a period
  int64_t num_dropped = 0;     // of streams: frames that the server skipped
  // Of all frames together.
  int64_t num_bytes = 0;
  int64_t num_vertices = 0;
  int64_t num_triangles = 0;
};

// Frames repeat: of 16 that everybody asks for; else no two are the same.
enum class Frames { kRepeated, kDifferent };

struct Calls {
  Frames frames = Frames::kDifferent;
  v1::Encoding::Preset preset = v1::Encoding::FASTEST;
  double per_second = 0.0;  // as many as this; 0: one after another
};

ClientReport CallFrames(const LoadTarget& target, const Calls& calls, const std::stop_token& stop);

// A stream in a loop whose weights the client changes at every frame.
ClientReport WatchStream(const LoadTarget& target, double frames_per_second,
                         const std::stop_token& stop);

// Streams of 60 frames/s that take half a second for each frame.
ClientReport WatchSlowly(const LoadTarget& target, const std::stop_token& stop);

// Opens streams and calls, and goes away without a word in the middle of them.
ClientReport Vanish(const LoadTarget& target, int client, const std::stop_token& stop);

// Sends random bytes and requests out of range; an error is an answer that is none.
ClientReport SendGarbage(const LoadTarget& target, int client, const std::stop_token& stop);

}  // namespace liquidblend::bench
