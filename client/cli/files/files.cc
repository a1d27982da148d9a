#include "client/cli/files/files.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::cli {

namespace fs = std::filesystem;

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    return absl::NotFoundError(absl::StrCat(path, " is a directory, not a file"));
  }
  std::ifstream input(path, std::ios::binary);
  if (!input) {
    return absl::NotFoundError(absl::StrCat(path, ": cannot be read: ", std::strerror(errno)));
  }
  std::string bytes{std::istreambuf_iterator<char>(input), std::istreambuf_iterator<char>()};
  if (!input) return absl::NotFoundError(absl::StrCat(path, ": cannot be read"));
  return bytes;
}

absl::Status CheckOutput(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    return absl::PermissionDeniedError(
        absl::StrCat(path, " is a folder; give the name of a file in it"));
  }
  const fs::path parent = fs::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  if (!fs::is_directory(folder, error)) {
    return absl::PermissionDeniedError(
        absl::StrCat(path, ": cannot be written: there is no folder ", folder, "; make it first"));
  }
  if (access(folder.c_str(), W_OK) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat(path, ": cannot be written: folder ", folder,
                                                  ": ", std::strerror(errno),
                                                  "; choose one that you may write to"));
}

absl::Status WriteFile(const std::string& path, const std::string& bytes) {
  if (const absl::Status status = CheckOutput(path); !status.ok()) return status;
  const std::string part = path + ".part";
  std::ofstream output(part, std::ios::binary | std::ios::trunc);
  if (!output) {
    return absl::PermissionDeniedError(
        absl::StrCat(part, ": cannot be written: ", std::strerror(errno)));
  }
  output.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  output.close();
  std::error_code error;
  if (!output) {
    fs::remove(part, error);
    return absl::InternalError(
        absl::StrCat(part, ": writing ", bytes.size(), " bytes failed; is the disk full?"));
  }
  fs::rename(part, path, error);
  if (error) return absl::InternalError(absl::StrCat(path, ": ", error.message()));
  return absl::OkStatus();
}

absl::Status MakeDirectory(const std::string& path) {
  std::error_code error;
  fs::create_directories(path, error);
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    return absl::PermissionDeniedError(
        absl::StrCat(path, ": ", error ? error.message() : "exists and is not a folder",
                     "; choose a folder that you may write to"));
  }
  return absl::OkStatus();
}

std::string Extension(const std::string& path) {
  const std::string name = absl::AsciiStrToLower(fs::path(path).filename().string());
  if (absl::EndsWith(name, ".bobj.gz")) return "bobj.gz";
  const size_t dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(dot + 1);
}

}  // namespace liquidblend::cli
