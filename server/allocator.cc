// The server's allocator is jemalloc: with glibc's, resident memory grows under load while
// allocated memory does not (docs/experiments/memory.md).
#include <jemalloc/jemalloc.h>

// Read before main. Pages that have been free for two seconds go back to the system, by a thread of
// the allocator's own, so that no request waits for it. The default of ten seconds keeps 13 MB more
// resident under attack (docs/experiments/serving.md).
const char* malloc_conf = "background_thread:true,dirty_decay_ms:2000";
