#include "client/src/files/part_file.h"

#include <cstdio>
#include <ios>

#include "absl/strings/str_cat.h"

namespace liquidblend::client {
namespace {

absl::Status CannotWrite(const std::string& path) {
  return absl::PermissionDeniedError(absl::StrCat(path, ": cannot be written"));
}

}  // namespace

PartFile::PartFile(const std::string& path, const std::string& checksum)
    : path_(path),
      part_(absl::StrCat(path, ".part")),
      expected_(checksum),
      checksum_(checksum),
      output_(part_, std::ios::binary | std::ios::trunc) {}

PartFile::~PartFile() { std::remove(part_.c_str()); }  // nothing after Commit()

absl::Status PartFile::Append(absl::string_view bytes) {
  checksum_.Add(bytes);
  output_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return output_.good() ? absl::OkStatus() : CannotWrite(part_);
}

absl::Status PartFile::Commit() {
  output_.close();
  if (output_.fail()) return CannotWrite(part_);
  if (const std::string sum = checksum_.Text(); sum != expected_) {
    return absl::DataLossError(
        absl::StrCat("the received file has the checksum ", sum, " instead of ", expected_));
  }
  return std::rename(part_.c_str(), path_.c_str()) == 0 ? absl::OkStatus() : CannotWrite(path_);
}

}  // namespace liquidblend::client
