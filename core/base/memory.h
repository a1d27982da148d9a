// Memory that a process has freed but still occupies.
#pragma once

namespace liquidblend::base {

// Blocks of a MiB and more go back to the system as soon as they are freed, whatever was freed
// before, so that the peak of a process is what it holds at once. Call once in main, before threads
// start. Cost: the pages of such blocks are cleared again when they are allocated.
void ReturnLargeBlocks();

// The opposite, for who allocates the same again and again: what was freed is kept, up to 128 MiB
// at the end of each heap, and blocks of up to 32 MiB are not mapped one by one. Call once in main,
// before threads start.
void KeepFreedMemory();

// Gives back what smaller blocks have left free.  Threads: safe.  Cost: milliseconds.
void ReturnFreeMemory();

}  // namespace liquidblend::base
