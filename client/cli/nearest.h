// The known word that is nearest to a mistyped one.
#pragma once

#include <string>
#include <vector>

namespace liquidblend::cli {

// The candidate with the fewest letters to insert, remove, replace or swap with the next one; "" if
// that is more than two, or half of the word. Cost: O(letters^2) a candidate.
std::string Nearest(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace liquidblend::cli
