// Memory that a process has freed but still occupies.
#pragma once

namespace liquidblend::base {

// Blocks of a MiB and more go back to the system as soon as they are freed, whatever was freed
// before, so that the peak of a process is what it holds at once. Call once in main, before threads
// start. Cost: the pages of such blocks are cleared again when they are allocated.
void ReturnLargeBlocks();

// Gives back what smaller blocks have left free.  Threads: safe.  Cost: milliseconds.
void ReturnFreeMemory();

}  // namespace liquidblend::base
