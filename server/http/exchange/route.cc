#include "server/http/exchange/route.h"

#include <algorithm>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "server/transcode/query.h"

namespace liquidblend::http {
namespace {

constexpr char kPageFiles[] = "/page/";
const std::vector<std::string>& ReadMethods() {
  static const auto& methods = *new std::vector<std::string>{"GET", "HEAD"};
  return methods;
}

struct FixedPath {
  const char* path;
  Resource resource;
};
constexpr FixedPath kFixedPaths[] = {{"/healthz", Resource::kHealth},
                                     {"/readyz", Resource::kReady},
                                     {"/metrics", Resource::kMetrics},
                                     {"/", Resource::kPage},
                                     {"/v1/stream", Resource::kStream}};

struct FrameFile {
  const char* folder;
  const char* file;
  const char* pattern;  // the path
  v1::Encoding::Format format;
  Resource resource;
};
constexpr FrameFile kFrameFiles[] = {
    {"/v1/families/", "/frame.drc", "/v1/families/{family}/frame.drc", v1::Encoding::DRACO,
     Resource::kFrame},
    {"/v1/families/", "/frame.ply", "/v1/families/{family}/frame.ply", v1::Encoding::PLY,
     Resource::kFrame},
    {"/v1/families/", "/frame.obj", "/v1/families/{family}/frame.obj", v1::Encoding::OBJ,
     Resource::kFrame},
    {"/v1/families/", "/frame.meshopt", "/v1/families/{family}/frame.meshopt",
     v1::Encoding::MESHOPT, Resource::kFrame},
    {"/v1/animations/", "/frame.drc", "/v1/animations/{animation}/frame.drc", v1::Encoding::DRACO,
     Resource::kAnimationFrame},
    {"/v1/animations/", "/frame.ply", "/v1/animations/{animation}/frame.ply", v1::Encoding::PLY,
     Resource::kAnimationFrame},
    {"/v1/animations/", "/frame.obj", "/v1/animations/{animation}/frame.obj", v1::Encoding::OBJ,
     Resource::kAnimationFrame},
    {"/v1/animations/", "/frame.meshopt", "/v1/animations/{animation}/frame.meshopt",
     v1::Encoding::MESHOPT, Resource::kAnimationFrame}};

// An id with a broken escape stays as it is: no id has a %.
std::string DecodedId(std::string_view text) {
  const absl::StatusOr<std::string> id = transcode::DecodePercent(text);
  return id.ok() ? *id : std::string(text);
}

Route FindFrame(absl::string_view path) {
  for (const FrameFile& file : kFrameFiles) {
    absl::string_view id = path;
    const bool fits = absl::ConsumePrefix(&id, file.folder) && absl::ConsumeSuffix(&id, file.file);
    if (!fits || absl::StrContains(id, '/')) continue;
    Route route;
    route.resource = file.resource;
    route.pattern = file.pattern;
    route.family = DecodedId({id.data(), id.size()});
    route.format = file.format;
    route.allowed = ReadMethods();
    return route;
  }
  return {};
}

Route FixedRoute(const FixedPath& fixed) {
  Route route;
  route.resource = fixed.resource;
  route.pattern = fixed.path;
  route.allowed = ReadMethods();
  return route;
}

// google.longrunning annotates all of its methods but this one.
std::vector<transcode::HttpRule> RulesOfTheApi() {
  std::vector<transcode::HttpRule> rules;
  for (const google::protobuf::ServiceDescriptor* service : server::ApiServices()) {
    for (transcode::HttpRule& rule : transcode::RulesOf(*service)) rules.push_back(std::move(rule));
    const auto* wait = service->FindMethodByName(server::kWaitOperation.name);
    if (wait == nullptr) continue;
    rules.push_back(transcode::MakeRule(*wait, "POST", "/v1/{name=operations/**}:wait", "*"));
  }
  return rules;
}

}  // namespace

bool Route::Allows(std::string_view http_method) const {
  return std::find(allowed.begin(), allowed.end(), http_method) != allowed.end();
}

bool Route::takes_body() const {
  return rule != nullptr &&
         (!rule->body.empty() || server::IsSame(*method, server::kUploadAnimation));
}

Routes::Routes() : table_(RulesOfTheApi()) {}

Route Routes::Find(std::string_view http_method, const std::string& path) const {
  for (const FixedPath& fixed : kFixedPaths) {
    if (path == fixed.path) return FixedRoute(fixed);
  }
  if (absl::StartsWith(path, kPageFiles)) return FixedRoute({"/page/{file}", Resource::kPage});
  Route route = FindFrame(path);
  if (route.resource != Resource::kNone) return route;
  route.allowed = table_.MethodsOf(path);
  if (route.allowed.empty()) return route;
  route.resource = Resource::kMethod;
  if (route.Allows("GET")) route.allowed.emplace_back("HEAD");
  const transcode::RouteMatch match =
      table_.Find(http_method == "HEAD" ? "GET" : http_method, path);
  if (match.rule == nullptr) return route;
  route.rule = match.rule;
  route.pattern = match.rule->pattern;
  route.variable = match.variable;
  route.method = server::FindMethod(match.rule->method->name());
  return route;
}

}  // namespace liquidblend::http
