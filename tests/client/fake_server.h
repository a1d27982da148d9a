// A liquidblend server for tests of the client: canned answers, and a record of what it was asked.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "liquidblend/client.h"
#include "liquidblend/mesh.h"

namespace liquidblend::testing {

// What one UploadAnimation call brought.
struct ReceivedUpload {
  std::string animation_id;
  std::string request_id;
  double frames_per_second = 0.0;
  std::map<std::string, std::string> files;  // name -> bytes
  std::map<std::string, int64_t> announced;  // name -> size_bytes
  std::vector<int64_t> chunk_bytes;
};

// It has the animations drops-a, drops-b and 2,500 more called many-0000 and so on; the families
// drops (source drops-a at height 1, target drops-b at height 3, 1 s at 24 frames per second) and
// empty (no version); the operations import-1 (succeeds), register-1 (succeeds), failed-1,
// cancelled-1 and endless-1. Frames show MakeOctahedron(weight, time). Threads: safe.
class FakeServer {
 public:
  FakeServer();
  ~FakeServer();
  FakeServer(const FakeServer&) = delete;
  FakeServer& operator=(const FakeServer&) = delete;

  std::string target() const;  // HOST:PORT
  int port() const;

  // The next `times` calls of `method` ("GetFamily") fail with `status` and its payloads.
  void FailNext(const std::string& method, int times, const absl::Status& status);
  // The next failures carry google.rpc details: an ErrorInfo and a BadRequest.
  void AddErrorDetails();
  // The next WatchOperation ends with UNAVAILABLE after one message.
  void BreakNextWatch();
  // The next lossless stream is that of an older server, which does not say which frame follows,
  // and ends with UNAVAILABLE after two frames.
  void BreakNextStream();
  // The next stream ends after so many frames, as when a server stops.
  void StopNextStream(int num_frames);
  // The next stream sends nothing after so many frames, and does not end.
  void HoldNextStream(int num_frames);
  // Health over gRPC; it is healthy unless told otherwise.
  void SetHealthy(bool is_healthy);
  // The next upload is refused after its first file, before the client has sent all.
  void RefuseNextUpload(const absl::Status& status);
  // From now on targets, reasons of verdicts, notes, stages and operations are called that.
  void SetWords(const std::string& words);

  int NumCalls(const std::string& method) const;
  std::vector<std::string> RequestIds() const;  // of RegisterFamily, one per call
  std::vector<ReceivedUpload> Uploads() const;
  // The last ImportAnimation, RegisterFamily, GetFrame or beginning of a StreamFrames, as protobuf
  // text.
  std::string LastRequest() const;
  // The trace of the last GetFrame, StreamFrames, UploadAnimation or WatchOperation.
  TraceHeaders LastTrace() const;
  std::vector<std::string> Deleted() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// The status with a google.rpc.RetryInfo; with a google.rpc.ErrorInfo.
absl::Status WithRetryDelay(absl::Status status, absl::Duration delay);
absl::Status WithReason(absl::Status status, const std::string& reason);

// A closed, oriented mesh of 8 triangles: radius 1 + weight, centre (time, 0, 0).
Mesh MakeOctahedron(double weight, double time_s);

// Draco, Edgebreaker, `position_bits` per coordinate.
std::string EncodeDraco(const Mesh& mesh, int position_bits);

}  // namespace liquidblend::testing
