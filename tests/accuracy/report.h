// The table of one registered scene, as Markdown.
#pragma once

#include <ostream>

#include "core/parallel/arena.h"
#include "tests/accuracy/registered_scene.h"
#include "tests/accuracy/scene.h"

namespace liquidblend::accuracy {

struct ReportOptions {
  int distance_step = 1;    // >= 1; distances and volumes are measured at every step-th frame
  int fold_step = 3;        // >= 1; folds likewise
  bool each_frame = false;  // a second table of distances, a row for each measured frame
};

struct Comparison {
  double best_middle = 0.0;    // distance of the best blend to the truth, over the early frames
  double best_baseline = 0.0;  // of the best of the two baselines
};

// Prints the tables and returns what stands for all of them: zeros without a truth.
Comparison PrintReport(const Scene& scene, const RegisteredScene& registered,
                       const ReportOptions& options, const parallel::Arena& arena,
                       std::ostream& out);

}  // namespace liquidblend::accuracy
