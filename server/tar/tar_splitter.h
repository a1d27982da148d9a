// Splitter of a tar archive that arrives in pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "server/tar/tar.h"

namespace liquidblend::tar {

// Takes what a TarSplitter finds. Its errors end the splitting.
class FileSink {
 public:
  virtual ~FileSink() = default;
  virtual absl::Status BeginFile(const TarEntry& file) = 0;
  virtual absl::Status AddBytes(std::span<const std::byte> bytes) = 0;  // of the last file
};

// Headers are collected (ustar, pax, GNU) and read by libarchive; contents go to the sink as they
// come. Directories are left out, names are without them. Keeps 64 KiB at most.
// Errors of all calls: kInvalidArgument for what is no tar archive, ends early, or holds anything
// else than regular files (links, devices, sparse files), for more than kMaxLeftOut directories,
// and for more than 4 MiB after its end.  Threads: one at a time.
class TarSplitter {
 public:
  static constexpr int kMaxLeftOut = 20'000;

  absl::Status Add(std::span<const std::byte> piece, FileSink& sink);
  // To be called last.
  absl::Status End() const;

 private:
  size_t TakeBlock(std::span<const std::byte> piece);
  absl::Status OnBlock(FileSink& sink);
  absl::Status OnHeader(FileSink& sink);

  std::string header_;          // blocks of the next file's, so far
  size_t block_begin_ = 0;      // of the block in it that is being collected
  int64_t extension_left_ = 0;  // bytes of a pax or GNU header that follow, with their padding
  int64_t content_left_ = 0;    // bytes of a file that follow
  int64_t padding_left_ = 0;    // bytes after it
  int num_left_out_ = 0;
  bool is_over_ = false;  // the end of the archive has come; what follows is ignored
  int64_t after_end_ = 0;
};

}  // namespace liquidblend::tar
