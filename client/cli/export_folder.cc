#include "client/cli/export_folder.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client/cli/files.h"
#include "client/src/frame_names.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kPartName[] = ".export.part";
constexpr size_t kMinDigits = 4;

bool IsFrameName(absl::string_view name, absl::string_view prefix, absl::string_view suffix) {
  if (!absl::ConsumePrefix(&name, prefix) || !absl::ConsumeSuffix(&name, suffix)) return false;
  return name.size() >= kMinDigits &&
         std::all_of(name.begin(), name.end(), [](char c) { return absl::ascii_isdigit(c); });
}

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

absl::Status CheckContent(const std::string& directory, const std::vector<std::string>& names,
                          ExportFolder::Policy policy) {
  if (names.empty()) return absl::OkStatus();
  if (policy == ExportFolder::Policy::kMustBeEmpty) {
    return absl::InvalidArgumentError(absl::StrCat(
        "-o ", directory, ": the folder is not empty, it holds ", names[0],
        names.size() > 1 ? absl::StrCat(" and ", names.size() - 1, " more") : "",
        "; choose another folder, or replace the frames of an earlier export with --overwrite"));
  }
  for (const std::string& name : names) {
    if (IsExportedName(name) || !client::IsAnimationFileName(name)) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        "-o ", directory, ": holds ", name,
        ", which no export writes and an import would read beside the new frames; choose another "
        "folder, or move the file away"));
  }
  return absl::OkStatus();
}

}  // namespace

bool IsExportedName(const std::string& name) {
  return name == "meta.json" || IsFrameName(name, "frame_", ".ply") ||
         IsFrameName(name, "frame_", ".obj") || IsFrameName(name, "fluid_mesh_", ".bobj.gz");
}

absl::StatusOr<ExportFolder> ExportFolder::Open(const std::string& directory, Policy policy) {
  LBC_RETURN_IF_ERROR(MakeDirectory(directory));
  LBC_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListNames(directory));
  LBC_RETURN_IF_ERROR(CheckContent(directory, names, policy));
  const fs::path part = fs::path(directory) / kPartName;
  std::error_code error;
  fs::remove_all(part, error);  // of an export that was killed
  if (!error) fs::create_directory(part, error);
  if (error) {
    return absl::PermissionDeniedError(absl::StrCat("-o ", directory,
                                                    ": cannot be written: ", error.message(),
                                                    "; choose a folder that you may write to"));
  }
  return ExportFolder(directory);
}

ExportFolder::ExportFolder(std::string directory) : directory_(std::move(directory)) {}

ExportFolder::ExportFolder(ExportFolder&& other) noexcept
    : directory_(std::exchange(other.directory_, std::string())) {}

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

absl::Status ExportFolder::Commit(const std::vector<std::string>& names) {
  LBC_ASSIGN_OR_RETURN(const std::vector<std::string> before, ListNames(directory_));
  std::error_code error;
  for (const std::string& name : before) {
    if (!IsExportedName(name)) continue;
    fs::remove(FinalPath(name), error);
    if (error) return Failure(FinalPath(name), error);
  }
  for (const std::string& name : names) {
    fs::rename(TemporaryPath(name), FinalPath(name), error);
    if (error) return Failure(FinalPath(name), error);
  }
  return absl::OkStatus();
}

}  // namespace liquidblend::cli
