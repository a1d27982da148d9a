// Tar archives of regular files as a stream, by libarchive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <ostream>
#include <span>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct archive;

namespace liquidblend::tar {

struct ArchiveCloser {
  void operator()(archive* closed) const;
};
using ArchivePtr = std::unique_ptr<archive, ArchiveCloser>;

// Writes POSIX ustar, with pax headers for values that do not fit.
// Errors of all calls: kUnavailable if the stream fails. Threads: one at a time.
class TarWriter {
 public:
  explicit TarWriter(std::ostream& out);

  absl::Status Add(const std::string& name, std::span<const std::byte> bytes);
  // To be called last.
  absl::Status End();

 private:
  std::ostream& out_;
  ArchivePtr archive_;
};

struct TarEntry {
  std::string name;  // without "./" in front
  int64_t size_bytes = 0;
};

// Reads the tar formats of libarchive: ustar, pax, GNU. Skips all but regular files.
// Errors of all calls: kDataLoss if the archive ends early or a header is damaged; kInvalidArgument
// if it is not a tar archive. Threads: one at a time.
class TarReader {
 public:
  using Take = absl::FunctionRef<absl::Status(std::span<const std::byte>)>;

  explicit TarReader(std::istream& in);
  ~TarReader();

  // The next file; the rest of the one before is skipped. Nothing at the archive's end.
  absl::StatusOr<std::optional<TarEntry>> Next();
  // Hands the file's bytes to `take`, chunk by chunk. Errors: also those of `take`.
  absl::Status Read(Take take);

 private:
  struct Source;

  absl::Status ErrorOf() const;

  std::unique_ptr<Source> source_;
  ArchivePtr archive_;
  bool has_begun_ = false;  // an entry has been read
};

}  // namespace liquidblend::tar
