// A folder on disk -> the input files of ReadAnimation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "worker/ingest/read_animation.h"

namespace liquidblend::ingest {

struct LoadedFile {
  std::string name;  // base name
  std::vector<std::byte> bytes;
};

struct LoadOptions {
  int64_t max_total_bytes = int64_t{64} << 30;  // >= 0
};

// Loads the regular files directly in the folder `path` whose names ReadAnimation reads (see
// IsInputName), sorted by name. Links to regular files count as such; others are ignored.
// Errors: kNotFound (no such folder), kResourceExhausted (max_total_bytes), kUnavailable (a read
// failed); the message names the path.
absl::StatusOr<std::vector<LoadedFile>> LoadDirectory(const std::string& path,
                                                      const LoadOptions& options = {});

// The same files as input of ReadAnimation; `files` must outlive the result.
std::vector<InputFile> Views(const std::vector<LoadedFile>& files);

}  // namespace liquidblend::ingest
