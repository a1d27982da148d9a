// Contact sheets: pictures in rows and columns, with labels.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/render/image.h"

namespace liquidblend::render {

// A row may be shorter than the others. Labels may have several lines; no labels: no space for
// them.
struct Sheet {
  std::vector<std::vector<Image>> rows;    // all pictures of one size
  std::vector<std::string> row_labels;     // left of each row
  std::vector<std::string> column_labels;  // above each column
};

// Errors: kInvalidArgument (more than kMaxPixels).
absl::StatusOr<Image> Compose(const Sheet& sheet);

}  // namespace liquidblend::render
