#include "server/transcode/query.h"

#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace liquidblend::transcode {
namespace {

constexpr size_t kMaxFields = 32;
constexpr size_t kMaxShownText = 40;

// -1: none.
int HexValue(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  if (digit >= 'a' && digit <= 'f') return digit - 'a' + 10;
  if (digit >= 'A' && digit <= 'F') return digit - 'A' + 10;
  return -1;
}

// For messages.
std::string EscapedPart(std::string_view text) {
  return absl::CHexEscape(std::string(text.substr(0, kMaxShownText)));
}

absl::StatusOr<QueryField> ParseField(std::string_view text) {
  const size_t equals = std::min(text.find('='), text.size());
  QueryField field;
  LB_ASSIGN_OR_RETURN(field.name, DecodePercent(text.substr(0, equals)));
  if (field.name.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("query: '", EscapedPart(text), "' has no name before '='"));
  }
  if (equals == text.size()) return field;
  LB_ASSIGN_OR_RETURN(field.value, DecodePercent(text.substr(equals + 1)));
  return field;
}

}  // namespace

absl::StatusOr<std::string> DecodePercent(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      const int high = i + 2 < text.size() ? HexValue(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? HexValue(text[i + 2]) : -1;
      if (high < 0 || low < 0) {
        return absl::InvalidArgumentError(absl::StrCat("'", EscapedPart(text.substr(i)),
                                                       "' does not begin with % and two digits"));
      }
      c = static_cast<char>(16 * high + low);
      i += 2;
    }
    if (c < ' ' || c > '~') {
      return absl::InvalidArgumentError(
          absl::StrCat("'", EscapedPart(text), "' has bytes that are not printable ASCII"));
    }
    decoded.push_back(c);
  }
  return decoded;
}

absl::StatusOr<std::vector<QueryField>> ParseQuery(std::string_view query) {
  std::vector<QueryField> fields;
  while (!query.empty()) {
    const size_t end = std::min(query.find('&'), query.size());
    const std::string_view text = query.substr(0, end);
    query.remove_prefix(std::min(end + 1, query.size()));
    if (text.empty()) continue;
    LB_ASSIGN_OR_RETURN(QueryField field, ParseField(text));
    const auto is_same = [&](const QueryField& other) { return other.name == field.name; };
    if (std::any_of(fields.begin(), fields.end(), is_same)) {
      return absl::InvalidArgumentError(
          absl::StrCat("query: ", EscapedPart(field.name), " is given twice"));
    }
    if (fields.size() == kMaxFields) {
      return absl::InvalidArgumentError(
          absl::StrCat("query: there are more than ", kMaxFields, " fields"));
    }
    fields.push_back(std::move(field));
  }
  return fields;
}

}  // namespace liquidblend::transcode
