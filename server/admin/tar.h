// Tar archives (POSIX ustar) of regular files, as a stream.
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <ostream>
#include <span>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace liquidblend::admin {

// Errors of all calls: kUnavailable if the stream takes no more. Threads: one at a time.
class TarWriter {
 public:
  explicit TarWriter(std::ostream& out) : out_(out) {}

  // Requires: the name has at most 100 bytes.
  absl::Status Add(const std::string& name, std::span<const std::byte> bytes);
  // Last.
  absl::Status End();

 private:
  absl::Status Write(const std::string& bytes);

  std::ostream& out_;
};

struct TarEntry {
  std::string name;  // without "./" in front
  int64_t size_bytes = 0;
};

// Passes over folders and what describes the files that follow (pax).
// Errors of all calls: kDataLoss if the archive ends early or a header is damaged; kInvalidArgument
// if it is no archive. Threads: one at a time.
class TarReader {
 public:
  using Take = absl::FunctionRef<absl::Status(std::span<const std::byte>)>;

  explicit TarReader(std::istream& in) : in_(in) {}

  // The next file; what is left of the one before is passed over. Nothing at the archive's end.
  absl::StatusOr<std::optional<TarEntry>> Next();
  // Hands the file's bytes to `take`, chunk by chunk. Errors: also those of `take`.
  absl::Status Read(Take take);

 private:
  absl::Status ReadBlock(std::span<char> block);
  absl::Status Skip();

  std::istream& in_;
  int64_t left_bytes_ = 0;  // of the current file
  int64_t padding_ = 0;     // after it
  bool has_begun_ = false;
};

}  // namespace liquidblend::admin
