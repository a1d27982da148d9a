// Keeps the threads of a third party's own parallel loops to the one that calls it.
#pragma once

#include "absl/functional/function_ref.h"

namespace liquidblend::parallel {

// Runs `work` on this thread, and with it every TBB loop that a library starts in there: on no
// other thread, and without taking up tasks of the arena that called it meanwhile (which would
// stack frame upon frame in memory). What `work` throws comes through.
void OnThisThread(absl::FunctionRef<void()> work);

}  // namespace liquidblend::parallel
