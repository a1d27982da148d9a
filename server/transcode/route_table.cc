#include "server/transcode/route_table.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "server/transcode/query.h"

namespace liquidblend::transcode {
namespace {

// A path in its parts, as sent.
struct Path {
  std::vector<std::string> segments;
  std::string verb;
};

// A colon of a name is escaped: what follows the last one is a verb.
Path Split(std::string_view text) {
  Path path;
  if (text.empty() || text[0] != '/') return path;
  text.remove_prefix(1);
  const size_t slash = text.rfind('/');
  const size_t colon = text.rfind(':');
  const bool has_verb =
      colon != std::string_view::npos && (slash == std::string_view::npos || colon > slash);
  if (has_verb && colon + 1 == text.size()) return path;  // of none
  if (has_verb) {
    path.verb = std::string(text.substr(colon + 1));
    text = text.substr(0, colon);
  }
  path.segments = absl::StrSplit(std::string(text), '/');
  return path;
}

bool Fits(const HttpRule& rule, const Path& path) {
  const bool takes_rest = rule.segments.back() == "**";
  const size_t size = rule.segments.size();
  if (rule.verb != path.verb || path.segments.size() < size) return false;
  if (!takes_rest && path.segments.size() != size) return false;
  for (size_t k = 0; k < size; ++k) {
    const std::string& expected = rule.segments[k];
    const bool is_id = expected == "*" || expected == "**";
    if (is_id ? path.segments[k].empty() : path.segments[k] != expected) return false;
  }
  return true;
}

std::string Decoded(const std::string& segment) {
  const absl::StatusOr<std::string> decoded = DecodePercent(segment);
  return decoded.ok() ? *decoded : segment;
}

// "**" takes all segments that are left.
std::string VariableOf(const HttpRule& rule, const Path& path) {
  const size_t end = rule.segments.back() == "**" ? path.segments.size() : rule.variable_end;
  std::vector<std::string> parts;
  for (size_t k = rule.variable_begin; k < end; ++k) parts.push_back(Decoded(path.segments[k]));
  return absl::StrJoin(parts, "/");
}

}  // namespace

RouteMatch RouteTable::Find(std::string_view http_method, std::string_view path) const {
  const Path parts = Split(path);
  for (const HttpRule& rule : rules_) {
    if (rule.http_method != http_method || !Fits(rule, parts)) continue;
    return {&rule, rule.variable.empty() ? "" : VariableOf(rule, parts)};
  }
  return {};
}

std::vector<std::string> RouteTable::MethodsOf(std::string_view path) const {
  const Path parts = Split(path);
  std::vector<std::string> methods;
  for (const HttpRule& rule : rules_) {
    const bool is_new =
        std::find(methods.begin(), methods.end(), rule.http_method) == methods.end();
    if (is_new && Fits(rule, parts)) methods.push_back(rule.http_method);
  }
  return methods;
}

}  // namespace liquidblend::transcode
