// Import sources: animations in directories of this machine that the operator has named. Knows no
// gRPC.
//
// Below a root, no symbolic link is followed, and paths are opened name by name from the directory
// above, so that nothing outside is reached, even if the disk changes meanwhile.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/posix_file.h"
#include "liquidblend/v1/liquidblend.pb.h"

namespace liquidblend::server {

// Names for clients -> directories, which clients never see.
using ImportRoots = std::map<std::string, std::string>;

// Parses NAME=DIR arguments; a name has the form of a resource's id.
// Errors: kInvalidArgument, kNotFound if there is no such directory.
absl::StatusOr<ImportRoots> ParseImportRoots(const std::vector<std::string>& arguments);

// The frames and descriptions in one directory (the same list as the client's
// ListAnimationFiles()), as the messages of an upload, sorted by name.  Threads: one at a time.
class ImportSource {
 public:
  // location: NAME or NAME/path; at most `max_files` files are listed, of frames those whose names
  // are like `pattern` (base/glob.h), unless that is empty.
  // Errors, all with a violation of `location` and its text, never a directory of the server:
  // kInvalidArgument if it is not of that form; kNotFound (IMPORT_ROOT_UNKNOWN, or no such
  // directory); kFailedPrecondition (NOT_A_DIRECTORY: also a symbolic link; NO_FRAMES);
  // kPermissionDenied.
  static absl::StatusOr<ImportSource> Open(const ImportRoots& roots, const std::string& location,
                                           int max_files, const std::string& pattern = "");

  // Puts the next message into `message`; false at the end.
  // Errors: as above, and kFailedPrecondition for a path that is not a regular file (NOT_A_FILE:
  // also a symbolic link) or changes meanwhile (FILE_CHANGED).
  absl::StatusOr<bool> Next(v1::UploadAnimationRequest& message);

 private:
  ImportSource(std::string location, base::FileHandle directory, std::vector<std::string> names)
      : location_(std::move(location)),
        directory_(std::move(directory)),
        names_(std::move(names)) {}
  absl::Status OpenFile(const std::string& name);
  absl::Status ReadChunk(std::string& chunk);

  std::string location_;
  base::FileHandle directory_;
  std::vector<std::string> names_;
  size_t num_opened_ = 0;
  base::FileHandle file_;   // the last one opened
  int64_t bytes_left_ = 0;  // of it
};

}  // namespace liquidblend::server
