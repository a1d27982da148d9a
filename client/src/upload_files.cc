#include "client/src/upload_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMaxChunkBytes = 1 << 20;

bool IsFrameFile(const std::string& name) {
  return absl::EndsWithIgnoreCase(name, ".bobj.gz") || absl::EndsWithIgnoreCase(name, ".ply") ||
         absl::EndsWithIgnoreCase(name, ".obj") || absl::EndsWithIgnoreCase(name, ".stl") ||
         absl::EndsWithIgnoreCase(name, ".vdb");
}

}  // namespace

absl::StatusOr<std::vector<std::string>> ListAnimationFiles(const std::string& directory) {
  std::error_code error;
  std::vector<std::string> files;
  bool has_frames = false;
  fs::directory_iterator entry(directory, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (!client::IsAnimationFileName(name) || !entry->is_regular_file(ignored)) continue;
    has_frames |= IsFrameFile(name);
    files.push_back(entry->path().string());
  }
  if (error) return absl::NotFoundError(absl::StrCat(directory, ": ", error.message()));
  if (!has_frames) {
    return absl::NotFoundError(absl::StrCat(
        directory, ": no frames (*.bobj.gz, *.ply, *.obj, *.stl or *.vdb) in this directory"));
  }
  std::sort(files.begin(), files.end());
  return files;
}

namespace client {

bool IsAnimationFileName(const std::string& name) {
  return IsFrameFile(name) || absl::EndsWith(name, ".uni") || name == "meta.json";
}

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
