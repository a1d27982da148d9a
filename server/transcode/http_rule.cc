#include "server/transcode/http_rule.h"

#include <algorithm>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "google/api/annotations.pb.h"

namespace liquidblend::transcode {
namespace {

bool IsWildcard(const std::string& segment) { return segment == "*" || segment == "**"; }

// "families" -> "family".
std::string Singular(absl::string_view collection) {
  if (absl::ConsumeSuffix(&collection, "ies")) return absl::StrCat(collection, "y");
  absl::ConsumeSuffix(&collection, "s");
  return std::string(collection);
}

std::string PatternOf(const HttpRule& rule) {
  std::string pattern;
  std::string collection;
  for (const std::string& segment : rule.segments) {
    const bool is_id = IsWildcard(segment);
    absl::StrAppend(&pattern, "/", is_id ? absl::StrCat("{", Singular(collection), "}") : segment);
    collection = segment;
  }
  return rule.verb.empty() ? pattern : absl::StrCat(pattern, ":", rule.verb);
}

std::pair<std::string, std::string> MethodAndPath(const google::api::HttpRule& rule) {
  switch (rule.pattern_case()) {
    case google::api::HttpRule::kGet:
      return {"GET", rule.get()};
    case google::api::HttpRule::kPut:
      return {"PUT", rule.put()};
    case google::api::HttpRule::kPost:
      return {"POST", rule.post()};
    case google::api::HttpRule::kDelete:
      return {"DELETE", rule.delete_()};
    case google::api::HttpRule::kPatch:
      return {"PATCH", rule.patch()};
    default:
      return {rule.custom().kind(), rule.custom().path()};
  }
}

}  // namespace

HttpRule MakeRule(const google::protobuf::MethodDescriptor& method, const std::string& http_method,
                  const std::string& path_template, const std::string& body) {
  HttpRule rule;
  rule.method = &method;
  rule.http_method = http_method;
  rule.body = body;
  absl::string_view rest = absl::StripPrefix(path_template, "/");
  const size_t verb = rest.rfind(':');
  if (verb != absl::string_view::npos) {
    rule.verb = std::string(rest.substr(verb + 1));
    rest = rest.substr(0, verb);
  }
  for (absl::string_view segment : absl::StrSplit(rest, '/')) {
    if (absl::ConsumePrefix(&segment, "{")) {
      const std::pair<absl::string_view, absl::string_view> sides =
          absl::StrSplit(segment, absl::MaxSplits('=', 1));
      rule.variable = std::string(sides.first);
      rule.variable_begin = rule.segments.size();
      segment = sides.second;
    }
    const bool ends_variable = absl::ConsumeSuffix(&segment, "}");
    rule.segments.emplace_back(segment);
    if (ends_variable) rule.variable_end = rule.segments.size();
  }
  rule.pattern = PatternOf(rule);
  return rule;
}

std::vector<HttpRule> RulesOf(const google::protobuf::ServiceDescriptor& service) {
  std::vector<HttpRule> rules;
  for (int k = 0; k < service.method_count(); ++k) {
    const google::protobuf::MethodDescriptor& method = *service.method(k);
    if (!method.options().HasExtension(google::api::http)) continue;
    const google::api::HttpRule& annotation = method.options().GetExtension(google::api::http);
    std::vector<const google::api::HttpRule*> bindings = {&annotation};
    for (const google::api::HttpRule& more : annotation.additional_bindings()) {
      bindings.push_back(&more);
    }
    for (const google::api::HttpRule* binding : bindings) {
      const auto [http_method, path] = MethodAndPath(*binding);
      rules.push_back(MakeRule(method, http_method, path, binding->body()));
    }
  }
  return rules;
}

}  // namespace liquidblend::transcode
