// Temporary file that grows by appending, for parts of an exported file that come before what is
// known last.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace liquidblend::cli {

// Errors of all methods: kInternal with the file and what may be the reason.
class Spool {
 public:
  // Makes the file, or empties it.
  static absl::StatusOr<Spool> Create(const std::string& path);

  absl::Status Append(absl::string_view bytes);
  // Appends all that `other` holds, and removes the other's file.
  absl::Status AppendAll(Spool& other);
  // Reads `count` bytes from `offset` on.
  absl::StatusOr<std::string> Read(int64_t offset, int64_t count);
  // Writes what is not yet on disk.
  absl::Status Close();

  int64_t size() const { return size_; }

 private:
  Spool(std::string path, std::fstream file) : path_(std::move(path)), file_(std::move(file)) {}

  std::string path_;
  std::fstream file_;
  int64_t size_ = 0;
};

}  // namespace liquidblend::cli
