#include "client/cli/export/spool.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/src/status_macros.h"

namespace liquidblend::cli {
namespace {

constexpr int64_t kCopyBytes = int64_t{1} << 22;

}  // namespace

absl::StatusOr<Spool> Spool::Create(const std::string& path) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out | std::ios::trunc);
  if (!file) {
    return absl::InternalError(absl::StrCat(path, ": cannot be written: ", std::strerror(errno)));
  }
  return Spool(path, std::move(file));
}

absl::Status Spool::Append(absl::string_view bytes) {
  file_.seekp(size_);
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file_) {
    return absl::InternalError(
        absl::StrCat(path_, ": writing ", bytes.size(), " bytes failed; is the disk full?"));
  }
  size_ += static_cast<int64_t>(bytes.size());
  return absl::OkStatus();
}

absl::Status Spool::AppendAll(Spool& other) {
  for (int64_t offset = 0; offset < other.size_; offset += kCopyBytes) {
    LBC_ASSIGN_OR_RETURN(const std::string bytes,
                         other.Read(offset, std::min(kCopyBytes, other.size_ - offset)));
    LBC_RETURN_IF_ERROR(Append(bytes));
  }
  std::error_code ignored;
  other.file_.close();  // or its room is not free
  std::filesystem::remove(other.path_, ignored);
  return absl::OkStatus();
}

absl::StatusOr<std::string> Spool::Read(int64_t offset, int64_t count) {
  std::string bytes(static_cast<size_t>(count), '\0');
  file_.seekg(offset);
  file_.read(bytes.data(), count);
  if (file_) return bytes;
  return absl::InternalError(absl::StrCat(path_, ": reading ", count, " bytes failed"));
}

absl::Status Spool::Close() {
  file_.close();
  if (file_) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(path_, ": cannot be written; is the disk full?"));
}

}  // namespace liquidblend::cli
