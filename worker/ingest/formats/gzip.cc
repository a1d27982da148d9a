#include "worker/ingest/formats/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "core/base/data_limit.h"
#include "core/base/status_macros.h"

namespace liquidblend::ingest {
namespace {

constexpr int64_t kFreeInflatedSize = int64_t{1} << 20;
constexpr int64_t kMaxRatio = 32;
constexpr int kGzipOnly = 16;             // added to zlib's window bits
constexpr size_t kMaxPiece = 1u << 30;    // zlib counts in 32 bits
constexpr size_t kSkipBufferSize = 4096;  // bytes

}  // namespace

struct GzipReader::Stream {
  z_stream z = {};
  bool is_ready = false;
};

int64_t MaxInflatedSize(int64_t compressed_size) {
  return kFreeInflatedSize + kMaxRatio * compressed_size;
}

GzipReader::GzipReader(std::span<const std::byte> compressed)
    : stream_(std::make_unique<Stream>()), rest_(compressed) {
  stream_->is_ready = inflateInit2(&stream_->z, MAX_WBITS + kGzipOnly) == Z_OK;
}

GzipReader::~GzipReader() {
  if (stream_->is_ready) inflateEnd(&stream_->z);
}

absl::Status GzipReader::Read(std::span<std::byte> out) {
  if (!stream_->is_ready) return base::MemoryLimitError("zlib has no memory");
  z_stream& z = stream_->z;
  while (!out.empty()) {
    if (at_end_) {
      return absl::DataLossError(
          absl::StrCat("the gzip stream ends after ", position_, " inflated bytes, too early"));
    }
    if (z.avail_in == 0) {
      const size_t piece = std::min(rest_.size(), kMaxPiece);
      z.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(rest_.data()));
      z.avail_in = static_cast<uInt>(piece);
      rest_ = rest_.subspan(piece);
    }
    const size_t wanted = std::min(out.size(), kMaxPiece);
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = static_cast<uInt>(wanted);
    const int result = inflate(&z, Z_NO_FLUSH);
    const size_t made = wanted - z.avail_out;
    out = out.subspan(made);
    position_ += static_cast<int64_t>(made);
    at_end_ = result == Z_STREAM_END;
    if (result == Z_BUF_ERROR || (result == Z_OK && made == 0 && z.avail_in + rest_.size() == 0)) {
      return absl::DataLossError(
          absl::StrCat("the gzip stream is truncated, after ", position_, " inflated bytes"));
    }
    if (result != Z_OK && result != Z_STREAM_END) {
      return absl::DataLossError(
          absl::StrCat("the gzip stream is corrupt after ", position_,
                       " inflated bytes: ", z.msg != nullptr ? z.msg : "zlib says no more"));
    }
  }
  return absl::OkStatus();
}

absl::Status GzipReader::Skip(int64_t size) {
  std::array<std::byte, kSkipBufferSize> buffer;
  while (size > 0) {
    const auto piece = std::min<int64_t>(size, kSkipBufferSize);
    LB_RETURN_IF_ERROR(Read(std::span(buffer).first(static_cast<size_t>(piece))));
    size -= piece;
  }
  return absl::OkStatus();
}

absl::Status GzipReader::ExpectEnd() {
  if (!at_end_) {
    std::byte extra;
    const int64_t before = position_;
    absl::Status status = Read({&extra, 1});
    if (position_ != before) {
      return absl::DataLossError(
          absl::StrCat("more data follows where the frame ends, at inflated byte ", before));
    }
    // The end of the stream was met while looking for one more byte: that is how it should be.
    if (!at_end_) return status;
  }
  const size_t left = stream_->z.avail_in + rest_.size();
  if (left == 0) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat(left, " bytes follow the end of the gzip stream"));
}

}  // namespace liquidblend::ingest
