#include "worker/ingest/formats/text.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace liquidblend::ingest {
namespace {

constexpr std::string_view kSeparators = " \t\r\n\v\f\\";
constexpr size_t kMaxQuotedLength = 40;

template <typename Number>
bool Parse(std::string_view word, Number& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size() && !word.empty();
}

}  // namespace

std::string_view NextWord(std::string_view& text) {
  const size_t begin = std::min(text.find_first_not_of(kSeparators), text.size());
  text.remove_prefix(begin);
  const size_t length = std::min(text.find_first_of(kSeparators), text.size());
  const std::string_view word = text.substr(0, length);
  text.remove_prefix(length);
  return word;
}

std::string_view NextLine(std::string_view& text, LineEnds ends) {
  size_t length = 0;
  for (size_t from = 0;;) {
    length = std::min(text.find('\n', from), text.size());
    const size_t last = length > 0 && text[length - 1] == '\r' ? length - 1 : length;
    const bool is_continued =
        ends == LineEnds::kContinued && length < text.size() && last > 0 && text[last - 1] == '\\';
    if (!is_continued) break;
    from = length + 1;
  }
  std::string_view line = text.substr(0, length);
  text.remove_prefix(std::min(length + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

bool ParseNumber(std::string_view word, double& value) { return Parse(word, value); }

bool ParseInteger(std::string_view word, int64_t& value) { return Parse(word, value); }

float ToFloat(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (std::abs(value) <= kLargest || std::isnan(value)) return static_cast<float>(value);
  return std::copysign(std::numeric_limits<float>::infinity(), value < 0 ? -1.0f : 1.0f);
}

std::string Quoted(std::string_view word) {
  const bool is_long = word.size() > kMaxQuotedLength;
  const std::string shown(word.substr(0, kMaxQuotedLength));
  return absl::StrCat("\"", absl::CHexEscape(shown), is_long ? "...\"" : "\"");
}

}  // namespace liquidblend::ingest
