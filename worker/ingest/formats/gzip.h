// Reader of gzip streams: inflates piece by piece, as far as the caller asks and no further.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/status.h"

namespace liquidblend::ingest {

// Limit of the inflated size of `compressed_size` bytes of a frame: 1 MiB + 32 times as much.
// Meshes inflate to 2 to 5 times; larger promises are decompression bombs and are refused before
// inflating.
int64_t MaxInflatedSize(int64_t compressed_size);

// One gzip stream. Memory: 48 KiB, whatever the bytes.
class GzipReader {
 public:
  explicit GzipReader(std::span<const std::byte> compressed);  // must outlive the reader
  ~GzipReader();
  GzipReader(const GzipReader&) = delete;
  GzipReader& operator=(const GzipReader&) = delete;

  // Fills `out` wholly. Errors: kDataLoss if the stream is truncated, corrupt or not gzip.
  absl::Status Read(std::span<std::byte> out);
  // Inflates and discards `size` bytes. Errors: as Read.
  absl::Status Skip(int64_t size);
  // OK if everything was read, the checksum is right and nothing follows. Errors: kDataLoss.
  absl::Status ExpectEnd();

  // Bytes inflated so far.
  int64_t position() const { return position_; }

 private:
  struct Stream;
  std::unique_ptr<Stream> stream_;
  std::span<const std::byte> rest_;  // not yet handed to zlib
  int64_t position_ = 0;
  bool at_end_ = false;  // zlib has seen the end of the stream and checked its sum
};

}  // namespace liquidblend::ingest
