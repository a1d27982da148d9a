// The known word that is nearest to a mistyped one.
#pragma once

#include <string>
#include <vector>

namespace liquidblend::base {

// The candidate that is nearest to the word: with the fewest letters to insert, remove, replace or
// swap with the next one. "" if that is more than two, or half of the word. Cost: O(letters^2) a
// candidate.
std::string Nearest(const std::string& word, const std::vector<std::string>& candidates);

// Message for an unknown command: "PROGRAM: there is no command 'chek'; did you mean 'check'?", and
// in a second line how to list them.
std::string UnknownCommandMessage(const std::string& program, const std::string& word,
                                  const std::vector<std::string>& commands);

}  // namespace liquidblend::base
