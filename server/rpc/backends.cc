#include "server/rpc/backends.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace liquidblend::rpc {
namespace {

absl::Status OutOfRange(absl::string_view field, int64_t value) {
  return absl::InvalidArgumentError(absl::StrCat("limit ", field, " is out of range: ", value));
}

}  // namespace

absl::Status Limits::Validate() const {
  if (max_upload_files < 1) return OutOfRange("max_upload_files", max_upload_files);
  if (max_upload_bytes < 1) return OutOfRange("max_upload_bytes", max_upload_bytes);
  if (max_chunk_bytes < 1) return OutOfRange("max_chunk_bytes", max_chunk_bytes);
  if (max_targets < 1) return OutOfRange("max_targets", max_targets);
  if (max_correspondences < 0) return OutOfRange("max_correspondences", max_correspondences);
  if (watch_interval <= absl::ZeroDuration()) {
    return absl::InvalidArgumentError(absl::StrCat("limit watch_interval is out of range: ",
                                                   absl::FormatDuration(watch_interval)));
  }
  return absl::OkStatus();
}

std::unique_ptr<FrameBuffers> BufferShelf::Take() {
  absl::MutexLock lock(&mutex_);
  if (buffers_.empty()) return std::make_unique<FrameBuffers>();
  std::unique_ptr<FrameBuffers> buffers = std::move(buffers_.back());
  buffers_.pop_back();
  return buffers;
}

void BufferShelf::GiveBack(std::unique_ptr<FrameBuffers> buffers) {
  absl::MutexLock lock(&mutex_);
  buffers_.push_back(std::move(buffers));
}

}  // namespace liquidblend::rpc
