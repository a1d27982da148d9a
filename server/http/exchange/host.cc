#include "server/http/exchange/host.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/host.h"
#include "server/base/errors.h"

namespace liquidblend::http {
namespace {

constexpr char kAny[] = "*";
constexpr size_t kMaxName = 253;  // of DNS
constexpr size_t kMaxShownHost = 80;

// The dot at the end only says that nothing is to be added.
bool IsSameName(absl::string_view a, absl::string_view b) {
  return absl::EqualsIgnoreCase(absl::StripSuffix(a, "."), absl::StripSuffix(b, "."));
}

bool IsServed(const std::string& host, const std::vector<std::string>& names) {
  const auto is_served_as = [&](absl::string_view name) {
    return std::any_of(names.begin(), names.end(),
                       [&](const std::string& one) { return IsSameName(one, name); });
  };
  if (host.empty() || is_served_as(kAny)) return true;
  const auto parts = base::SplitHostPort(host);
  if (!parts.has_value()) return false;
  if (base::IsIpAddress(parts->host)) return true;
  return !parts->is_bracketed &&
         (IsSameName(parts->host, "localhost") || is_served_as(parts->host));
}

// "https://example.org:8443" -> "example.org:8443".
absl::string_view HostOf(absl::string_view origin) {
  const size_t slashes = origin.find("://");
  return slashes == absl::string_view::npos ? origin : origin.substr(slashes + 3);
}

}  // namespace

absl::Status CheckHost(const std::string& host, const std::vector<std::string>& names) {
  if (IsServed(host, names)) return absl::OkStatus();
  const std::string shown = server::CleanText(host, kMaxShownHost);
  return server::WithReason(
      absl::PermissionDeniedError(absl::StrCat(
          "this server is not known as '", shown,
          "': ask for it by IP address or localhost, or start it with --http-host NAME")),
      "HOST_NOT_ALLOWED", {{"host", shown}});
}

absl::Status CheckOrigin(const std::string& origin, const std::string& host,
                         const std::string& allowed) {
  const bool is_allowed = origin.empty() || allowed == "*" || origin == allowed ||
                          (!host.empty() && absl::EqualsIgnoreCase(HostOf(origin), host));
  if (is_allowed) return absl::OkStatus();
  const std::string shown = server::CleanText(origin, kMaxShownHost);
  return server::WithReason(absl::PermissionDeniedError(absl::StrCat(
                                "pages of ", shown, " may not do this here; see --http-origin")),
                            "ORIGIN_NOT_ALLOWED", {{"origin", shown}});
}

bool IsHostName(const std::string& name) {
  if (name == kAny) return true;
  const auto is_good = [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= kMaxName && std::all_of(name.begin(), name.end(), is_good);
}

}  // namespace liquidblend::http
