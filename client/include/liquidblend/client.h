// Client of a liquidblend server.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "liquidblend/animation.h"
#include "liquidblend/family.h"
#include "liquidblend/frame.h"
#include "liquidblend/frame_stream.h"
#include "liquidblend/operation.h"
#include "liquidblend/security.h"

namespace liquidblend {

// Calls that may be repeated safely are repeated while no server can be reached (kUnavailable):
// after initial_backoff, then twice as long each time up to max_backoff, each wait times a random
// number in [0.5, 1]. Calls that the server refuses for now (kResourceExhausted or kUnavailable
// with google.rpc.RetryInfo) are repeated after the delay that it gives, times a random number in
// [1, 1.25], regardless of max_attempts, while these waits fit into `patience`; otherwise the error
// names the delay. Writes carry a request id, so a repeated write takes effect once.
struct RetryOptions {
  int max_attempts = 5;  // >= 1
  absl::Duration initial_backoff = absl::Milliseconds(100);
  absl::Duration max_backoff = absl::Seconds(5);
  // >= 0; of one call: the total of the waits that the server asks for; 0: none. Also how long a
  // server may be away while an operation is submitted or watched.
  absl::Duration patience = absl::Seconds(30);
  // Whether other calls, too, are repeated while a server has been away for less than `patience`,
  // when the attempts are used up.
  bool is_patient = false;
};

// Trace that a call belongs to, as headers of the W3C's Trace Context. What is not printable ASCII
// is not sent.
struct TraceHeaders {
  std::string traceparent;  // "00-{trace id}-{span id}-{flags}"; empty: the call is in no trace
  std::string tracestate;
};

struct ConnectOptions {
  // HOST:PORT, or any gRPC target, also a name of several servers (dns:///NAME:PORT); or several,
  // separated by commas: servers of one store. Calls go to all of them in turn. One that cannot be
  // reached, or is about to stop, is left out, and its calls go to the next at once.
  std::string target = "127.0.0.1:50051";
  // How long Connect waits for the server; time in which this program does not run is not counted.
  absl::Duration connect_timeout = absl::Seconds(5);
  absl::Duration call_timeout = absl::Seconds(30);  // per attempt of a short call
  absl::Duration upload_timeout = absl::InfiniteDuration();
  // 1 s to an hour. Interval of keepalive pings while a call waits and nothing is received. Without
  // an answer within the same time the connection is lost (kUnavailable).
  absl::Duration keepalive = absl::Seconds(20);
  // Whether files are sent and fetched directly, where servers give urls of their object store.
  bool direct_transfers = true;
  RetryOptions retry;
  SecurityOptions security;
  // Gives the trace of each call, on the thread that makes it; null: calls are in none. Requires:
  // safe on any thread.
  std::function<TraceHeaders()> trace;
  absl::Status Validate() const;  // names the first field out of range, and its value
};

// The files of one animation.
struct UploadRequest {
  std::string animation;           // the id, with or without "animations/"
  std::vector<std::string> files;  // paths; base names must differ
  ImportOptions options;
  int64_t chunk_bytes = 512 << 10;  // [1, 1 MiB]
  int priority = 0;                 // [-100, 100]; larger ones are worked on first
};

// An animation in a directory that the server may read: ROOT/directory, ROOT being one of the
// import roots that its operator has named.
struct ImportRequest {
  std::string animation;  // the id, with or without "animations/"
  std::string location;
  ImportOptions options;
  int priority = 0;  // [-100, 100]; larger ones are worked on first
};

struct UploadProgress {
  int64_t bytes_sent = 0;
  int64_t bytes_total = 0;
  int files_sent = 0;
  int files_total = 0;
};

// Lists the frames in a directory and their descriptions: the regular files named *.bobj.gz, *.uni,
// *.ply, *.obj, *.stl, *.vdb and meta.json, sorted by name.
//   pattern  chooses frames by their names, as a shell does ("foam.*"), and the velocities of those
//            that are chosen; empty: all
// Errors: kNotFound if there is no such directory or no such frame in it.
absl::StatusOr<std::vector<std::string>> ListAnimationFiles(const std::string& directory,
                                                            const std::string& pattern = "");

// Frames are never of an older version of their family than the newest that this Client has got
// from GetFamily(), ListFamilies() or RollbackFamily(), or as the result of an operation. Resource
// names may be given with or without their collection ("drops" or "animations/drops").
// Errors of every call: the server's with its details in the message; kUnavailable if it cannot be
// reached; kDeadlineExceeded.  Threads: safe.
class Client {
 public:
  // Waits until the server answers.  Errors: kUnavailable, kInvalidArgument.
  static absl::StatusOr<std::unique_ptr<Client>> Connect(const ConnectOptions& options = {});
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // Uploads files and starts their import. `progress` runs on the calling thread, once per chunk;
  // when the upload has to be repeated it starts again at 0. Like ImportAnimation() and
  // RegisterFamily(), it is repeated for RetryOptions::patience while no server can be reached.
  // Errors: kNotFound or kInvalidArgument for the local files, before anything is sent, also if
  // their names are not one sequence of frames.
  absl::StatusOr<Operation> UploadAnimation(
      const UploadRequest& request,
      const std::function<void(const UploadProgress&)>& progress = {});
  // Has the server copy the files there and starts their import; takes up to upload_timeout.
  absl::StatusOr<Operation> ImportAnimation(const ImportRequest& request);
  // Downloads the stored file (docs/formats.md) of "animations/a" or "families/f" into the file
  // `path`: from the object store, or through the server where there is none. The file is verified,
  // and whole or missing. Returns its size in bytes.
  //   version  of a family; 0: the published one
  // Errors: kUnimplemented if the server is too old for it, or for versions by number; kDataLoss if
  // the received file has another checksum; kAborted if it was replaced meanwhile.
  absl::StatusOr<int64_t> Download(const std::string& name, const std::string& path,
                                   int64_t version = 0);
  absl::StatusOr<Animation> GetAnimation(const std::string& name);
  absl::StatusOr<std::vector<Animation>> ListAnimations();  // all pages
  absl::Status DeleteAnimation(const std::string& name);

  // Starts a registration.
  absl::StatusOr<Operation> RegisterFamily(const RegisterRequest& request);
  // version 0: the published one. Another number: that version of the family, if it is kept.
  // Errors, also: kUnimplemented if the server is too old to find versions by number.
  absl::StatusOr<Family> GetFamily(const std::string& name, int64_t version = 0);
  absl::StatusOr<std::vector<Family>> ListFamilies();  // all pages
  // Publishes a kept version (Family::kept_versions) again, as the newest one with a number of its
  // own. Errors: kNotFound if it is not kept; kFailedPrecondition while the family is registered.
  absl::StatusOr<Family> RollbackFamily(const std::string& name, int64_t version);
  absl::Status DeleteFamily(const std::string& name);  // all versions

  absl::StatusOr<Operation> GetOperation(const std::string& name);
  absl::StatusOr<std::vector<Operation>> ListOperations();  // all pages
  absl::Status CancelOperation(const std::string& name);
  // Calls `update` each time the operation's progress changes, until it is done or `update` returns
  // false (kCancelled; the operation itself goes on). Reconnects after a lost connection, and while
  // no server can be reached for less than RetryOptions::patience.
  // Returns the operation as last seen; Operation::result has its outcome. For a registration that
  // has published a version, returns when every reachable server of ConnectOptions::target serves
  // at least that version.
  //   timeout  of the whole call, whatever the servers do
  // Errors: kDeadlineExceeded after `timeout`; also if one of them does not serve the version
  // within call_timeout or RetryOptions::patience, whichever is longer.
  absl::StatusOr<Operation> WatchOperation(const std::string& name,
                                           const std::function<bool(const Operation&)>& update,
                                           absl::Duration timeout = absl::InfiniteDuration());
  // Waits until the operation is done.
  absl::StatusOr<Operation> WaitOperation(const std::string& name);

  // One frame; DecodeMesh(frame.data) makes a Mesh of it.
  absl::StatusOr<Frame> GetFrame(const FrameRequest& request);
  absl::StatusOr<std::unique_ptr<FrameStream>> StreamFrames(const StreamSettings& settings);

 private:
  class Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace liquidblend
