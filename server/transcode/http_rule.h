// HTTP rules: how a method of the API is called by HTTP, as its annotation google.api.http says.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

namespace liquidblend::transcode {

// A path template is that of google/api/http.proto with at most one variable, as
// "/v1/{name=animations/*}:verb".
struct HttpRule {
  const google::protobuf::MethodDescriptor* method = nullptr;
  std::string http_method;  // "GET", "POST", "DELETE"..
  std::vector<std::string>
      segments;               // "v1", "animations", "*"; "**" is last and takes all the rest
  std::string verb;           // after the colon, or empty
  std::string variable;       // the field that gets a part of the path, or empty
  size_t variable_begin = 0;  // its segments: from this one on
  size_t variable_end = 0;    // to before this one
  std::string body;           // "*", or empty: there is none
  std::string pattern;        // for people and metrics: "/v1/animations/{animation}:verb"
};

// The rules of all methods of a service that have the annotation, additional_bindings included.
// Requires: the annotations are of the form above, as a test of the API checks.
std::vector<HttpRule> RulesOf(const google::protobuf::ServiceDescriptor& service);

// A rule that no annotation has.
//   path_template  as in google.api.http
HttpRule MakeRule(const google::protobuf::MethodDescriptor& method, const std::string& http_method,
                  const std::string& path_template, const std::string& body);

}  // namespace liquidblend::transcode
