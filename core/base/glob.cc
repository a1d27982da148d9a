#include "core/base/glob.h"

#include <cstddef>

namespace liquidblend::base {
namespace {

// Whether the set that begins at pattern[start], a '[', has the character; `end` is set to the
// place after its ']'. A '[' that is not closed matches itself.
bool SetHas(absl::string_view pattern, size_t start, char character, size_t& end) {
  size_t p = start + 1;
  const bool is_negated = p < pattern.size() && pattern[p] == '!';
  if (is_negated) ++p;
  const size_t first = p;
  bool has = false;
  for (; p < pattern.size() && (pattern[p] != ']' || p == first); ++p) {
    const bool is_range = p + 2 < pattern.size() && pattern[p + 1] == '-' && pattern[p + 2] != ']';
    const char last = is_range ? pattern[p + 2] : pattern[p];
    has = has || (pattern[p] <= character && character <= last);
    if (is_range) p += 2;
  }
  if (p >= pattern.size()) {
    end = start + 1;
    return character == '[';
  }
  end = p + 1;
  return has != is_negated;
}

// Whether pattern[p], which is not '*', matches the character; `end` is set to the place after it.
bool OneMatches(absl::string_view pattern, size_t p, char character, size_t& end) {
  if (pattern[p] == '[') return SetHas(pattern, p, character, end);
  end = p + 1;
  return pattern[p] == '?' || pattern[p] == character;
}

}  // namespace

bool MatchesGlob(absl::string_view pattern, absl::string_view name) {
  size_t p = 0, n = 0, end = 0;
  size_t star = absl::string_view::npos, star_n = 0;  // the last '*', and the end of its match
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_n = n;
    } else if (p < pattern.size() && OneMatches(pattern, p, name[n], end)) {
      p = end;
      ++n;
    } else if (star != absl::string_view::npos) {
      p = star + 1;
      n = ++star_n;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace liquidblend::base
