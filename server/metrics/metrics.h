// Metrics of the server for Prometheus; docs/operations/logs-and-metrics.md lists the names.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/metrics/snapshot.h"

namespace liquidblend::metrics {

// Stages of a frame, from the call to the wire.
enum class Stage { kQueue, kSlice, kFinish, kEncode, kWrite };  // kSlice: with blending

// Times of the stages of one frame.
struct StageTimes {
  absl::Duration slice;
  absl::Duration finish;
  absl::Duration encode;
};

// Measures one stage after the other.
class StopWatch {
 public:
  // The time since the last call, or since this was made.
  absl::Duration Lap() {
    const Clock::time_point before = std::exchange(start_, Clock::now());
    return absl::FromChrono(start_ - before);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

// One call that has been answered. Few different values of each: every combination is kept.
struct Answered {
  absl::string_view protocol;  // "grpc" or "http"
  absl::string_view method;    // of HTTP: with the path's pattern, e.g. "GET /v1/families"
  absl::string_view code;      // "OK", "NOT_FOUND"...; of HTTP: "200"
  absl::Duration duration;
};

// A job that has ended. Jobs of a registration's targets count with it.
struct EndedJob {
  absl::string_view kind;  // "import" or "registration"
  absl::StatusCode code = absl::StatusCode::kOk;
  std::optional<absl::Duration> waited;  // until work began; nothing: it never did, or not known
  std::optional<absl::Duration> worked;  // from then on
  int64_t num_lost = 0;                  // attempts that lost their worker
  int64_t num_failed = 0;                // attempts that failed otherwise
};

// A collection of unreferenced blobs.
struct Collection {
  bool is_ok = false;
  int64_t num_blobs = 0;  // deleted
  int64_t num_bytes = 0;  // of these
};

// The metrics, with a registry of their own.
// Threads: safe.  Cost: about a microsecond a call; Text() some milliseconds.
class Metrics {
 public:
  Metrics();
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  // Counts a frame that was made. The first 256 families have their own labels, the others "other".
  void CountFrame(const std::string& family, absl::string_view preset, size_t num_bytes,
                  const StageTimes& times);
  void CountDroppedFrames(const std::string& family, int64_t num_frames);
  void ObserveStage(Stage stage, absl::Duration duration);
  void CountRequest(const Answered& answered);
  // "http" or "websocket". Allocates nothing, as destructors call it.
  void AddConnections(absl::string_view kind, int change) noexcept;
  void CountRefusedConnection();
  void AddStreams(int change);  // of frames, over any wire
  void CountJob(const EndedJob& job);
  void CountCollection(const Collection& collection);

  // All metrics in Prometheus' text format 0.0.4, with the process' memory and processor time.
  std::string Text(const Snapshot& snapshot) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace liquidblend::metrics
