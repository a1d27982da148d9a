// Route table: which rule a request's method and path meet.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/transcode/http_rule.h"

namespace liquidblend::transcode {

struct RouteMatch {
  const HttpRule* rule = nullptr;  // of the table; none: no route, or not for this method
  std::string variable;            // what the rule's field gets, decoded: "animations/drop"
};

// Threads: safe.
class RouteTable {
 public:
  explicit RouteTable(std::vector<HttpRule> rules) : rules_(std::move(rules)) {}

  // The path as sent, with its escapes. A segment whose escape is broken stays as it is: no id has
  // a %.
  RouteMatch Find(std::string_view http_method, std::string_view path) const;

  // The HTTP methods that the path has, in the order of the rules, each once; empty: no such path.
  std::vector<std::string> MethodsOf(std::string_view path) const;

  const std::vector<HttpRule>& rules() const { return rules_; }

 private:
  const std::vector<HttpRule> rules_;
};

}  // namespace liquidblend::transcode
