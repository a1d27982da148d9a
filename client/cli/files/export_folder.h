// The folder of an export: frames and their meta.json appear in it together, or not at all.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace liquidblend::cli {

// Files are written into a subfolder first, ".export.part". Commit() moves them to their place.
// Until then the files of an earlier export stay; a failed export leaves no files.
// Threads: one at a time; one export into a folder at a time.
class ExportFolder {
 public:
  enum class Policy { kMustBeEmpty, kOverwrite };

  // Makes the folder and the subfolder.
  // Errors: kInvalidArgument if the folder holds anything and must be empty, or if it holds files
  // that `import` would read beside the new frames and that are not of an earlier export, according
  // to its meta.json; kPermissionDenied if it cannot be written.
  static absl::StatusOr<ExportFolder> Open(const std::string& directory, Policy policy);

  ExportFolder(ExportFolder&& other) noexcept;
  ExportFolder& operator=(ExportFolder&&) = delete;
  ~ExportFolder();  // removes the subfolder

  // A file's path until Commit(), and its path after it.
  std::string TemporaryPath(const std::string& name) const;
  std::string FinalPath(const std::string& name) const;

  // Checks that none of the names is that of a file that no earlier export has written.
  // Errors: kInvalidArgument.
  absl::Status CheckUnused(const std::vector<std::string>& names) const;

  // Removes the files of the earlier export that existed at Open(), then moves `names` to their
  // places, in this order.
  // Errors: kInternal with the file and the system's reason. Then the subfolder stays with what is
  // not in its place yet, and no function may be called any more.
  absl::Status Commit(const std::vector<std::string>& names);

 private:
  ExportFolder(std::string directory, std::vector<std::string> replaced);
  absl::Status KeepPart(const absl::Status& failure);
  std::string directory_;              // empty: moved from, or its subfolder is to stay
  std::vector<std::string> replaced_;  // names of an earlier export's files, meta.json the last
};

}  // namespace liquidblend::cli
