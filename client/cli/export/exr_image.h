// OpenEXR images of three numbers a pixel, written row by row.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/export/spool.h"

namespace liquidblend::cli {

// Size and type of an image.
struct ExrFormat {
  enum class Number { kFloat, kHalf };
  int width = 0;   // > 0
  int height = 0;  // > 0
  Number number = Number::kFloat;
};

// Writes scan lines from the top on, channels R, G and B, ZIP compression.
// Errors of all methods: those of Spool.  Threads: one at a time.
class ExrImage {
 public:
  static absl::StatusOr<ExrImage> Create(const std::string& path, const ExrFormat& format);

  // Appends one row.  row: 3 * width numbers
  absl::Status AddRow(const std::vector<float>& row);

  // Completes the file. Requires: all rows were added.
  absl::Status Finish();

 private:
  ExrImage(const ExrFormat& format, Spool file, Spool blocks)
      : format_(format), file_(std::move(file)), blocks_(std::move(blocks)) {}

  absl::Status FinishBlock();

  ExrFormat format_;
  Spool file_;
  Spool blocks_;
  std::string block_;             // rows of the present block, not yet compressed
  std::vector<int64_t> offsets_;  // of blocks in blocks_
  int num_rows_ = 0;
};

// The nearest half-precision number, as bits; beyond the largest one, that.
uint16_t ToHalf(float value);

}  // namespace liquidblend::cli
