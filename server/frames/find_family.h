// Look-up of the families that calls for frames name, and what keeps them in memory and fresh.
#pragma once

#include <cstdint>
#include <string>

#include "absl/functional/any_invocable.h"
#include "absl/time/time.h"
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

// Starts to record what families are asked for in the catalog, every minute until the pools stop.
void KeepUsesRecorded(Backends& backends);

// Records it once, soon: the server is about to stop.
void RecordUses(Backends& backends);

// Loads the families that are asked for most, and calls `when_over` once: when they are there, or
// `limit` has passed. Not if the pools stop before.
void Preload(Backends& backends, absl::Duration limit, absl::AnyInvocable<void()> when_over);

}  // namespace liquidblend::server
