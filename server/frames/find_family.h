// Look-up of the families that calls for frames name.
#pragma once

#include <cstdint>
#include <string>

#include "server/frames/backends.h"

namespace liquidblend::server {

// Finds a family and calls `done` once: before this returns if the family is in memory or the call
// is refused, else on a thread of `io` or `loads`. A version that is being loaded is waited for
// only if `asked` allows no other.
// Families in memory are at most about half a second behind the catalog while it can be asked
// (KeepFamiliesFresh), and behind a deletion by this server only during a query of the catalog.
// Errors: Families::GetReady's; kResourceExhausted, kUnavailable (WorkPool::Post).
void FindFamily(Backends& backends, const std::string& id, liquidblend::catalog::AskedVersion asked,
                liquidblend::catalog::Families::Done done);

// Whether calls for the latest version get an older one than `version` from memory, until the newer
// one is loaded.
bool IsBehind(Backends& backends, const std::string& id, int64_t version);

// Starts a periodic search for new versions of the families in memory, until the pools stop, so
// that they are loaded before a call needs them.
void KeepFamiliesFresh(Backends& backends);

}  // namespace liquidblend::server
