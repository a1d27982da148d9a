#include "core/base/nearest.h"

#include <algorithm>
#include <cstddef>

#include "absl/strings/str_cat.h"

namespace liquidblend::base {
namespace {

constexpr size_t kMostEdits = 2;

// Damerau's edit distance, in the form that edits no letter twice.
size_t Distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> edits(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        edits[i][j] = i + j;
        continue;
      }
      const size_t replaced = edits[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      edits[i][j] = std::min({replaced, edits[i - 1][j] + 1, edits[i][j - 1] + 1});
      const bool is_swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_swapped) edits[i][j] = std::min(edits[i][j], edits[i - 2][j - 2] + 1);
    }
  }
  return edits[a.size()][b.size()];
}

}  // namespace

std::string Nearest(const std::string& word, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t fewest = std::min(kMostEdits, word.size() / 2) + 1;
  for (const std::string& candidate : candidates) {
    const size_t edits = Distance(word, candidate);
    if (edits >= fewest) continue;
    fewest = edits;
    nearest = candidate;
  }
  return nearest;
}

std::string UnknownCommandMessage(const std::string& program, const std::string& word,
                                  const std::vector<std::string>& commands) {
  const std::string nearest = Nearest(word, commands);
  return absl::StrCat(program, ": there is no command '", word, "'",
                      nearest.empty() ? "" : absl::StrCat("; did you mean '", nearest, "'?"), "\n`",
                      program, " --help` lists all commands.\n");
}

}  // namespace liquidblend::base
