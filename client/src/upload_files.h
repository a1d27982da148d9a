// The local files of one upload, read chunk by chunk.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "liquidblend/client.h"

namespace liquidblend::client {

struct UploadFile {
  std::string path;
  std::string name;        // base name
  int64_t size_bytes = 0;  // when it was listed
};

// Errors: kInvalidArgument for no files, equal base names, a chunk size out of range, or names that
// are not a sequence (CheckFrameNames; gaps with a meta.json with frame_times are checked by the
// server); kNotFound for a path that is not a readable regular file.
absl::StatusOr<std::vector<UploadFile>> CheckUpload(const UploadRequest& request);

// Calls `chunk` with at most chunk_bytes at a time until it returns false.
// Errors: kNotFound if the file cannot be opened, kDataLoss if it has another size than listed.
absl::Status ReadChunks(const UploadFile& file, int64_t chunk_bytes,
                        const std::function<bool(std::string bytes)>& chunk);

}  // namespace liquidblend::client
