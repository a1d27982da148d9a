#include "client/cli/files/export_folder.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/files/export_meta.h"
#include "client/cli/files/files.h"
#include "client/src/frame_names.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kPartName[] = ".export.part";

absl::Status Failure(const fs::path& path, const std::error_code& error) {
  return absl::InternalError(absl::StrCat(path.string(), ": ", error.message()));
}

// Names of what is in the folder, sorted.
absl::StatusOr<std::vector<std::string>> ListNames(const std::string& directory) {
  std::error_code error;
  std::vector<std::string> names;
  fs::directory_iterator entry(directory, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    names.push_back(entry->path().filename().string());
  }
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("-o ", directory, ": cannot be listed: ", error.message()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

// Of `names` those that earlier exports have written, meta.json the last: as it says itself, and as
// one says that was not moved to its place any more, unlike some of its frames.
std::vector<std::string> FilesOfEarlierExports(const std::string& directory,
                                               const std::vector<std::string>& names) {
  std::vector<std::string> found;
  const fs::path folder(directory);
  for (const fs::path& meta : {folder / kMetaName, folder / kPartName / kMetaName}) {
    const absl::StatusOr<std::string> bytes = ReadFile(meta.string());
    const auto files = bytes.ok() ? ExportedFilesIn(*bytes) : std::nullopt;
    if (!files.has_value()) continue;
    for (const std::string& name : names) {
      const bool is_meta = name == kMetaName && meta == folder / kMetaName;
      if (is_meta || files->Contain(name)) found.push_back(name);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::stable_partition(found.begin(), found.end(),
                        [](const std::string& name) { return name != kMetaName; });
  return found;
}

// An export that could not move all of its files has left its meta.json among the rest. In the
// folder, the frames that were moved are known by it for as long as they are there.
absl::Status KeepMeta(const fs::path& folder) {
  std::error_code error;
  const fs::path left = folder / kPartName / kMetaName;
  if (fs::exists(folder / kMetaName, error) || !fs::exists(left, error)) return absl::OkStatus();
  fs::rename(left, folder / kMetaName, error);
  return error ? Failure(left, error) : absl::OkStatus();
}

absl::Status CheckContent(const std::string& directory, const std::vector<std::string>& names,
                          const std::vector<std::string>& replaced, ExportFolder::Policy policy) {
  if (names.empty()) return absl::OkStatus();
  if (policy == ExportFolder::Policy::kMustBeEmpty) {
    return absl::InvalidArgumentError(absl::StrCat(
        "-o ", directory, ": the folder is not empty, it holds ", names[0],
        names.size() > 1 ? absl::StrCat(" and ", names.size() - 1, " more") : "",
        "; choose another folder, or replace the frames of an earlier export with --overwrite"));
  }
  for (const std::string& name : names) {
    const bool is_replaced = std::count(replaced.begin(), replaced.end(), name) > 0;
    if (is_replaced || !client::IsAnimationFileName(name)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "-o ", directory, ": holds ", name,
        ", which an import would read beside the new frames and which is not a file of an earlier "
        "export, as its meta.json says; choose another folder, or move the file away"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<ExportFolder> ExportFolder::Open(const std::string& directory, Policy policy) {
  LBC_RETURN_IF_ERROR(MakeDirectory(directory));
  if (policy == Policy::kOverwrite) LBC_RETURN_IF_ERROR(KeepMeta(directory));
  LBC_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListNames(directory));
  std::vector<std::string> replaced = FilesOfEarlierExports(directory, names);
  LBC_RETURN_IF_ERROR(CheckContent(directory, names, replaced, policy));
  const fs::path part = fs::path(directory) / kPartName;
  std::error_code error;
  fs::remove_all(part, error);  // of an export that was killed
  if (!error) fs::create_directory(part, error);
  if (error) {
    return absl::PermissionDeniedError(absl::StrCat("-o ", directory,
                                                    ": cannot be written: ", error.message(),
                                                    "; choose a folder that you may write to"));
  }
  return ExportFolder(directory, std::move(replaced));
}

ExportFolder::ExportFolder(std::string directory, std::vector<std::string> replaced)
    : directory_(std::move(directory)), replaced_(std::move(replaced)) {}

ExportFolder::ExportFolder(ExportFolder&& other) noexcept
    : directory_(std::exchange(other.directory_, std::string())),
      replaced_(std::move(other.replaced_)) {}

ExportFolder::~ExportFolder() {
  if (directory_.empty()) return;
  std::error_code ignored;
  fs::remove_all(fs::path(directory_) / kPartName, ignored);
}

std::string ExportFolder::TemporaryPath(const std::string& name) const {
  return (fs::path(directory_) / kPartName / name).string();
}

std::string ExportFolder::FinalPath(const std::string& name) const {
  return (fs::path(directory_) / name).string();
}

absl::Status ExportFolder::CheckUnused(const std::vector<std::string>& names) const {
  for (const std::string& name : names) {
    std::error_code error;
    const bool is_replaced = std::count(replaced_.begin(), replaced_.end(), name) > 0;
    if (is_replaced || !fs::exists(FinalPath(name), error)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("-o ", directory_, ": holds ", name,
                     ", which the export would replace and which is not a file of an earlier "
                     "export; choose another folder, or move the file away"));
  }
  return absl::OkStatus();
}

absl::Status ExportFolder::Commit(const std::vector<std::string>& names) {
  std::error_code error;
  for (const std::string& name : replaced_) {
    fs::remove(FinalPath(name), error);
    if (error) return KeepPart(Failure(FinalPath(name), error));
  }
  for (const std::string& name : names) {
    fs::rename(TemporaryPath(name), FinalPath(name), error);
    if (error) return KeepPart(Failure(FinalPath(name), error));
  }
  return absl::OkStatus();
}

// What is not moved yet stays, and its meta.json, by which the next export knows these files.
absl::Status ExportFolder::KeepPart(const absl::Status& failure) {
  const std::string part = (fs::path(directory_) / kPartName).string();
  directory_.clear();
  return absl::Status(failure.code(), absl::StrCat(std::string(failure.message()),
                                                   "; the files that are not in their place yet "
                                                   "are in ",
                                                   part));
}

}  // namespace liquidblend::cli
