#include "worker/ingest/read_directory.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::ingest {
namespace {

namespace fs = std::filesystem;

absl::StatusOr<std::vector<std::string>> InputNames(const std::string& path) {
  std::error_code error;
  fs::directory_iterator entry(path, error);
  if (error) return absl::NotFoundError(absl::StrCat(path, ": ", error.message()));
  std::vector<std::string> names;
  while (entry != fs::directory_iterator()) {
    const std::string name = entry->path().filename().string();
    std::error_code no_status;
    if (IsInputName(name) && entry->is_regular_file(no_status)) names.push_back(name);
    entry.increment(error);
    if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

absl::StatusOr<std::vector<std::byte>> ReadFile(const std::string& path, int64_t max_bytes) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return absl::UnavailableError(absl::StrCat(path, ": ", error.message()));
  if (size > static_cast<std::uintmax_t>(max_bytes)) {
    return absl::ResourceExhaustedError(
        absl::StrCat(path, ": ", size, " bytes more than may be loaded, ", max_bytes, " are left"));
  }
  std::vector<std::byte> bytes(size);
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (stream.gcount() != static_cast<std::streamsize>(size)) {
    return absl::UnavailableError(
        absl::StrCat(path, ": read ", stream.gcount(), " of ", size, " bytes"));
  }
  return bytes;
}

}  // namespace

absl::StatusOr<std::vector<LoadedFile>> LoadDirectory(const std::string& path,
                                                      const LoadOptions& options) {
  LB_ASSIGN_OR_RETURN(const std::vector<std::string> names, InputNames(path));
  std::vector<LoadedFile> files;
  int64_t num_left = options.max_total_bytes;
  for (const std::string& name : names) {
    LB_ASSIGN_OR_RETURN(std::vector<std::byte> bytes,
                        ReadFile((fs::path(path) / name).string(), num_left));
    num_left -= static_cast<int64_t>(bytes.size());
    files.push_back({name, std::move(bytes)});
  }
  return files;
}

std::vector<InputFile> Views(const std::vector<LoadedFile>& files) {
  std::vector<InputFile> views;
  views.reserve(files.size());
  for (const LoadedFile& file : files) views.push_back({file.name, file.bytes});
  return views;
}

}  // namespace liquidblend::ingest
