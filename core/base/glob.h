// Patterns of file names.
#pragma once

#include "absl/strings/string_view.h"

namespace liquidblend::base {

// Whether the whole name matches the pattern. In it * stands for any characters, ? for one,
// [abc0-9] for one of these, [!abc] for one that is none of them; every other byte for itself.
// Threads: safe.  Cost: O(bytes of the pattern times bytes of the name).
bool MatchesGlob(absl::string_view pattern, absl::string_view name);

}  // namespace liquidblend::base
