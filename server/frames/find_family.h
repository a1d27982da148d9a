// How calls for frames get at the family they name.
#pragma once

#include <cstdint>
#include <string>

#include "server/frames/backends.h"

namespace liquidblend::server {

// Calls `done` once: before this returns if the family is in memory or the call is refused, else on
// a thread of `io` or `loads`. What is in memory is about half a second behind the catalog at most
// while that can be asked (KeepFamiliesFresh), and later than a deletion by this server only where
// a look into the catalog was under way.
// A version that is on its way into memory is waited for only if `asked` allows no other.
// Errors: Families::GetReady's; kResourceExhausted, kUnavailable (WorkPool::Post).
void FindFamily(Backends& backends, const std::string& id, liquidblend::catalog::AskedVersion asked,
                liquidblend::catalog::Families::Done done);

// Whether calls for the latest version would get an older one than this from memory; the newer one
// is being loaded then, and soon they do not.
bool IsBehind(Backends& backends, const std::string& id, int64_t version);

// From now on looks for new versions of the families in memory every now and then, until the pools
// stop; so they are ready before anybody has to wait for them.
void KeepFamiliesFresh(Backends& backends);

}  // namespace liquidblend::server
