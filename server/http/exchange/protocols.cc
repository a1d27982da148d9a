#include "server/http/exchange/protocols.h"

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"

namespace liquidblend::http {
namespace {

constexpr char kBearer[] = "liquidblend.bearer.";

}  // namespace

Protocols ParseProtocols(const std::string& header) {
  Protocols protocols;
  for (absl::string_view offer : absl::StrSplit(header, ',')) {
    offer = absl::StripAsciiWhitespace(offer);
    if (offer == kStreamProtocol) protocols.has_ours = true;
    if (!absl::ConsumePrefix(&offer, kBearer)) continue;
    if (!absl::WebSafeBase64Unescape(offer, &protocols.token)) {
      protocols.token = std::string(offer);
    }
  }
  return protocols;
}

}  // namespace liquidblend::http
