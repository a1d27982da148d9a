#include "client/src/upload_files.h"

#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/frame_names.h"
#include "client/src/status_macros.h"

namespace liquidblend {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMaxChunkBytes = 1 << 20;
constexpr size_t kMaxMetaBytes = 1 << 16;
constexpr char kMetaName[] = "meta.json";

absl::Status FolderError(const std::string& directory, const std::error_code& error) {
  std::error_code ignored;
  if (fs::is_regular_file(directory, ignored)) {
    return absl::NotFoundError(
        absl::StrCat(directory, ": is a file; give the folder that holds the frames"));
  }
  return absl::NotFoundError(absl::StrCat(directory, ": ", error.message(), " (a folder on this ",
                                          "machine; --from-server takes one of the server's)"));
}

// Whether meta.json says when the frames are.
bool SaysFrameTimes(const std::string& meta_path) {
  std::ifstream file(meta_path, std::ios::binary);
  std::string text(kMaxMetaBytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(file.gcount()));
  return absl::StrContains(text, "\"frame_times\"");
}

bool IsChosen(const std::string& name, const std::string& pattern) {
  return pattern.empty() || !client::IsFrameName(name) ||
         fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

absl::Status CheckNames(const std::vector<client::UploadFile>& files,
                        const ImportOptions& options) {
  auto rule = options.allow_gaps ? client::NumberRule::kGapsAllowed : client::NumberRule::kNoGaps;
  if (!options.frame_times.empty()) rule = client::NumberRule::kTimesGiven;
  std::vector<std::string> names;
  for (const client::UploadFile& file : files) {
    if (IsChosen(file.name, options.pattern)) names.push_back(file.name);
    if (file.name == kMetaName && SaysFrameTimes(file.path)) {
      rule = client::NumberRule::kTimesGiven;
    }
  }
  if (!options.pattern.empty()) names = client::WithoutStrayVelocities(names);
  return client::CheckFrameNames(names, options.format, rule);
}

}  // namespace

absl::StatusOr<std::vector<std::string>> ListAnimationFiles(const std::string& directory,
                                                            const std::string& pattern) {
  std::error_code error;
  std::vector<std::string> names;
  int num_frames = 0, num_chosen = 0;
  std::string example;
  fs::directory_iterator entry(directory, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (!client::IsAnimationFileName(name) || !entry->is_regular_file(ignored)) continue;
    if (client::IsFrameName(name)) {
      ++num_frames;
      if (example.empty() || name < example) example = name;
      if (!IsChosen(name, pattern)) continue;
      ++num_chosen;
    }
    names.push_back(name);
  }
  if (error) return FolderError(directory, error);
  if (num_chosen == 0) {
    return absl::NotFoundError(
        num_frames > 0
            ? absl::StrCat(directory, ": none of its ", num_frames, " frames, such as ", example,
                           ", is called '", pattern,
                           "' (--pattern: * stands for any characters, ? for one)")
            : absl::StrCat(directory,
                           ": no frames (*.bobj.gz, *.ply, *.obj, *.stl or *.vdb) in this "
                           "directory"));
  }
  if (!pattern.empty()) names = client::WithoutStrayVelocities(names);
  std::sort(names.begin(), names.end());
  for (std::string& name : names) name = (fs::path(directory) / name).string();
  return names;
}

namespace client {

absl::StatusOr<std::vector<UploadFile>> CheckUpload(const UploadRequest& request) {
  LBC_RETURN_IF_ERROR(request.options.Validate());
  if (request.chunk_bytes < 1 || request.chunk_bytes > kMaxChunkBytes) {
    return absl::InvalidArgumentError(absl::StrCat("chunk_bytes is ", request.chunk_bytes,
                                                   "; it must be in [1, ", kMaxChunkBytes, "]"));
  }
  if (request.files.empty()) return absl::InvalidArgumentError("files is empty");
  std::vector<UploadFile> files;
  std::set<std::string> names;
  for (const std::string& path : request.files) {
    std::error_code error;
    const auto size = fs::file_size(path, error);
    if (error) return absl::NotFoundError(absl::StrCat(path, ": ", error.message()));
    UploadFile file{path, fs::path(path).filename().string(), static_cast<int64_t>(size)};
    if (!names.insert(file.name).second) {
      return absl::InvalidArgumentError(absl::StrCat("two files are called ", file.name));
    }
    files.push_back(std::move(file));
  }
  LBC_RETURN_IF_ERROR(CheckNames(files, request.options));
  return files;
}

absl::Status ReadChunks(const UploadFile& file, int64_t chunk_bytes,
                        const std::function<bool(std::string bytes)>& chunk) {
  std::ifstream input(file.path, std::ios::binary);
  if (!input) return absl::NotFoundError(absl::StrCat(file.path, ": cannot be opened"));
  int64_t left = file.size_bytes;
  while (left > 0) {
    std::string bytes(static_cast<size_t>(std::min(left, chunk_bytes)), '\0');
    input.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (input.gcount() != static_cast<std::streamsize>(bytes.size())) break;
    left -= static_cast<int64_t>(bytes.size());
    if (!chunk(std::move(bytes))) return absl::OkStatus();
  }
  if (left > 0 || input.peek() != std::ifstream::traits_type::eof()) {
    return absl::DataLossError(absl::StrCat(file.path, ": changed while it was uploaded"));
  }
  return absl::OkStatus();
}

}  // namespace client
}  // namespace liquidblend
