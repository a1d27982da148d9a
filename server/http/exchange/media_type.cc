#include "server/http/exchange/media_type.h"

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "server/base/errors.h"

namespace liquidblend::http {
namespace {

constexpr size_t kMaxShownType = 40;

}  // namespace

absl::Status CheckMediaType(const std::string& content_type, const std::string& expected) {
  const absl::string_view type = absl::string_view(content_type).substr(0, content_type.find(';'));
  if (absl::EqualsIgnoreCase(absl::StripAsciiWhitespace(type), expected)) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("Content-Type must be ", expected, ", got '",
                                                 server::CleanText(content_type, kMaxShownType),
                                                 "'"));
}

}  // namespace liquidblend::http
