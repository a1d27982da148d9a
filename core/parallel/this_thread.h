// Restriction of a third party's parallel loops to the calling thread.
#pragma once

#include "absl/functional/function_ref.h"

namespace liquidblend::parallel {

// Runs `work` on this thread, and with it every TBB loop that a library starts in there: on no
// other thread, and without taking up tasks of the arena that called it meanwhile (which would
// stack frame upon frame in memory). Exceptions of `work` pass through.
void OnThisThread(absl::FunctionRef<void()> work);

}  // namespace liquidblend::parallel
