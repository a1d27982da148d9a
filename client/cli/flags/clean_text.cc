#include "client/cli/flags/clean_text.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace liquidblend::cli {
namespace {

struct Character {
  size_t num_bytes = 0;  // 0: no UTF-8
  uint32_t code = 0;
};

// The character that `text` begins with. Requires: it is not empty.
Character FirstOf(absl::string_view text) {
  const auto byte = [&](size_t i) { return uint32_t{static_cast<unsigned char>(text[i])}; };
  const uint32_t first = byte(0);
  if (first < 0x80) return {1, first};
  const size_t num_bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < num_bytes) return {};
  uint32_t code = first & (0x7FU >> num_bytes);
  for (size_t i = 1; i < num_bytes; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3F);
  }
  const uint32_t least = num_bytes == 4 ? 0x10000 : num_bytes == 3 ? 0x800 : 0x80;
  const bool is_surrogate = code >= 0xD800 && code < 0xE000;
  if (code < least || code > 0x10FFFF || is_surrogate) return {};
  return {num_bytes, code};
}

bool IsControl(uint32_t code) { return code < 0x20 || (code >= 0x7F && code < 0xA0); }

// Marks of direction, and separators of lines and paragraphs.
bool IsOfLayout(uint32_t code) {
  return code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x2028 && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

std::string Clean(absl::string_view text, bool keeps_newlines) {
  std::string clean;
  clean.reserve(text.size());
  while (!text.empty()) {
    const Character character = FirstOf(text);
    const bool is_kept = character.code == '\n'
                             ? keeps_newlines
                             : !IsControl(character.code) && !IsOfLayout(character.code);
    const size_t num_bytes = std::max<size_t>(character.num_bytes, 1);
    absl::StrAppend(&clean, is_kept ? text.substr(0, num_bytes) : "?");
    text.remove_prefix(num_bytes);
  }
  return clean;
}

}  // namespace

std::string CleanText(absl::string_view text) { return Clean(text, /*keeps_newlines=*/true); }
std::string CleanLine(absl::string_view text) { return Clean(text, /*keeps_newlines=*/false); }

std::string EscapeJson(absl::string_view json) {
  std::string escaped;
  escaped.reserve(json.size());
  while (!json.empty()) {
    const Character character = FirstOf(json);
    const size_t num_bytes = std::max<size_t>(character.num_bytes, 1);
    if (character.code >= 0x7F && IsControl(character.code)) {
      absl::StrAppendFormat(&escaped, "\\u%04x", character.code);
    } else {
      absl::StrAppend(&escaped, json.substr(0, num_bytes));
    }
    json.remove_prefix(num_bytes);
  }
  return escaped;
}

}  // namespace liquidblend::cli
