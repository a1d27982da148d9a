// A connection to a liquidblend server.
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
// with google.rpc.RetryInfo) are repeated after the delay that it asks for, times a random number
// in [1, 1.25], whatever max_attempts is, while these waits fit into `patience`; otherwise the
// error names the delay. Writes carry a request id, so a repeated write is done once.
struct RetryOptions {
  int max_attempts = 5;  // >= 1
  absl::Duration initial_backoff = absl::Milliseconds(100);
  absl::Duration max_backoff = absl::Seconds(5);
  // >= 0; of one call, for waits that the server asks for; 0: they are not waited for. Likewise for
  // a server that is away while an operation is submitted or watched.
  absl::Duration patience = absl::Seconds(30);
};

struct ConnectOptions {
  // HOST:PORT, or any gRPC target; or several, separated by commas: servers of one store. While the
  // one that is used cannot be reached, calls go to the next at once, and stay there.
  std::string target = "127.0.0.1:50051";
  absl::Duration connect_timeout = absl::Seconds(5);  // how long Connect waits for the server
  absl::Duration call_timeout = absl::Seconds(30);    // per attempt of a short call
  absl::Duration upload_timeout = absl::InfiniteDuration();
  // 1 s to an hour. While a call waits and nothing comes for so long, the server is asked for a
  // sign of life; without one for as long again the connection is lost (kUnavailable).
  absl::Duration keepalive = absl::Seconds(20);
  // Where servers give urls of their object store, files are sent and got there directly.
  bool direct_transfers = true;
  RetryOptions retry;
  SecurityOptions security;
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

// The frames in a directory and what describes them: the regular files named *.bobj.gz, *.uni,
// *.ply, *.obj, *.stl, *.vdb and meta.json, sorted by name.
//   pattern  chooses frames by their names, as a shell does ("foam.*"), and the velocities of those
//            that are chosen; empty: all
// Errors: kNotFound if there is no such directory or no such frame in it.
absl::StatusOr<std::vector<std::string>> ListAnimationFiles(const std::string& directory,
                                                            const std::string& pattern = "");

// Frames are never of an older version of their family than one that this Client has heard of: from
// GetFamily(), ListFamilies() or RollbackFamily(), or as the result of an operation.
// Resource names may be given with or without their collection ("drops" or "animations/drops").
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
  // Errors: kNotFound or kInvalidArgument for the local files, before anything is sent: also if
  // their names do not make one sequence of frames.
  absl::StatusOr<Operation> UploadAnimation(
      const UploadRequest& request,
      const std::function<void(const UploadProgress&)>& progress = {});
  // Has the server copy the files there and starts their import; takes up to upload_timeout.
  absl::StatusOr<Operation> ImportAnimation(const ImportRequest& request);
  // Gets the stored file (docs/formats.md) of "animations/a" or "families/f" into the file `path`,
  // which is whole and as the server says, or not there. Returns its bytes.
  //   version  of a family; 0: the published one
  // Errors: kUnimplemented if the server gives no urls, or none of versions by number; kDataLoss if
  // what came is something else.
  absl::StatusOr<int64_t> Download(const std::string& name, const std::string& path,
                                   int64_t version = 0);
  absl::StatusOr<Animation> GetAnimation(const std::string& name);
  absl::StatusOr<std::vector<Animation>> ListAnimations();  // all pages
  absl::Status DeleteAnimation(const std::string& name);

  // Starts a registration.
  absl::StatusOr<Operation> RegisterFamily(const RegisterRequest& request);
  // version 0: the published one. Another: the family as it was in that one, if it is kept.
  // Errors, also: kUnimplemented if the server is too old to find one by its number.
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
  // false (kCancelled; the operation itself goes on). Goes on by itself after a lost connection,
  // and while no server can be reached for less than RetryOptions::patience.
  // Returns the operation as last seen; Operation::result says how it ended.
  // Of a registration that has published a version, returns when every server of
  // ConnectOptions::target that can be reached serves at least that version.
  // Errors: kDeadlineExceeded if one of them does not within call_timeout or
  // RetryOptions::patience, whichever is longer.
  absl::StatusOr<Operation> WatchOperation(const std::string& name,
                                           const std::function<bool(const Operation&)>& update);
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
