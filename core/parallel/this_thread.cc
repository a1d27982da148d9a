#include "core/parallel/this_thread.h"

#include <tbb/task_arena.h>

namespace liquidblend::parallel {

void OnThisThread(absl::FunctionRef<void()> work) {
  tbb::task_arena arena(/*max_concurrency=*/1);
  arena.execute(work);
}

}  // namespace liquidblend::parallel
