#include "server/http/router.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/base/errors.h"
#include "server/base/request_id.h"
#include "server/http/call_lines.h"
#include "server/http/frame_answer.h"
#include "server/http/host.h"
#include "server/http/query.h"
#include "server/http/replies.h"
#include "server/http/requests.h"

namespace liquidblend::http {
namespace {

constexpr char kAllowed[] = "GET, HEAD, OPTIONS";
constexpr char kStreamPath[] = "/v1/stream";
constexpr char kFamiliesPath[] = "/v1/families";
constexpr char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";
constexpr size_t kMaxShownPath = 80;

// Escapes arbitrary bytes for messages.
std::string EscapedPath(const std::string& text) {
  return absl::CHexEscape(text.substr(0, kMaxShownPath));
}

struct Target {
  std::string path;
  std::string query;
  std::string host;  // with its port, or empty
};

// Of a target that may begin with scheme and host.
Target SplitTarget(const std::string& target) {
  size_t begin = 0;
  std::string host;
  if (absl::StartsWith(target, "http://") || absl::StartsWith(target, "https://")) {
    const size_t host_begin = target.find("//") + 2;
    begin = std::min(target.find_first_of("/?", host_begin), target.size());
    host = target.substr(host_begin, begin - host_begin);
  }
  const size_t query = std::min(target.find('?', begin), target.size());
  return {target.substr(begin, query - begin), target.substr(std::min(query + 1, target.size())),
          std::move(host)};
}

enum class Resource { kNone, kHealth, kReady, kMetrics, kFamilies, kFamily, kFrame, kStream };

struct Route {
  Resource resource = Resource::kNone;
  const char* pattern = "other";                      // the path, for metrics
  std::string family;                                 // its id, if the path has one
  v1::Encoding::Format format = v1::Encoding::DRACO;  // of a frame
};

struct FrameFile {
  const char* part;     // of the path
  const char* pattern;  // the path
  v1::Encoding::Format format;
};
constexpr FrameFile kFrameFiles[] = {
    {"/frame.drc", "/v1/families/{family}/frame.drc", v1::Encoding::DRACO},
    {"/frame.ply", "/v1/families/{family}/frame.ply", v1::Encoding::PLY},
    {"/frame.obj", "/v1/families/{family}/frame.obj", v1::Encoding::OBJ}};

// A family id with a broken escape stays as it is: no id has a %.
std::string DecodedId(std::string_view text) {
  const absl::StatusOr<std::string> id = DecodePercent(text);
  return id.ok() ? *id : std::string(text);
}

Route FindRoute(const std::string& path) {
  if (path == "/healthz") return {Resource::kHealth, "/healthz", ""};
  if (path == "/readyz") return {Resource::kReady, "/readyz", ""};
  if (path == "/metrics") return {Resource::kMetrics, "/metrics", ""};
  if (path == kStreamPath) return {Resource::kStream, kStreamPath, ""};
  if (path == kFamiliesPath) return {Resource::kFamilies, kFamiliesPath, ""};
  if (!absl::StartsWith(path, absl::StrCat(kFamiliesPath, "/"))) return {};
  std::string_view rest(path);
  rest.remove_prefix(sizeof(kFamiliesPath));
  const size_t end = std::min(rest.find('/'), rest.size());
  const std::string family = DecodedId(rest.substr(0, end));
  rest.remove_prefix(end);
  if (rest.empty()) return {Resource::kFamily, "/v1/families/{family}", family};
  for (const FrameFile& file : kFrameFiles) {
    if (rest == file.part) return {Resource::kFrame, file.pattern, family, file.format};
  }
  return {};
}

bool IsKnownMethod(const std::string& method) {
  return method == "GET" || method == "HEAD" || method == "OPTIONS";
}

bool IsForProbes(Resource resource) {
  return resource == Resource::kHealth || resource == Resource::kReady;
}

server::AccessRequest AccessRequestOf(Resource resource) {
  server::AccessRequest access;
  if (resource == Resource::kFrame) access.scope = server::Scope::kFrames;
  return access;
}

Response NoSuchPath(const std::string& path) {
  return ErrorReply(absl::NotFoundError(absl::StrCat(
      "there is no path '", EscapedPath(path),
      "'; there are /v1/families, /v1/families/{family}, /v1/families/{family}/frame.drc (or .ply, "
      ".obj), /v1/stream, /healthz, /readyz and /metrics")));
}

Response MethodNotAllowed(const std::string& method) {
  Response response = ErrorReply(
      absl::UnimplementedError(absl::StrCat("method ", EscapedPath(method),
                                            " is not for this path; there are ", kAllowed)),
      405);
  response.headers.emplace_back("Allow", kAllowed);
  return response;
}

Response BodyNotTaken() {
  return ErrorReply(absl::InvalidArgumentError("a request here has no body"), 413);
}

Response Preflight() {
  Response response;
  response.code = 204;
  response.headers = {
      {"Allow", kAllowed},
      {"Access-Control-Allow-Methods", kAllowed},
      {"Access-Control-Allow-Headers", "Authorization, If-None-Match, X-Request-Id"},
      {"Access-Control-Max-Age", "86400"}};
  return response;
}

Response UpgradeRequired() {
  Response response = ErrorReply(
      absl::FailedPreconditionError("this path is a WebSocket: ask for an upgrade"), 426);
  response.headers.emplace_back("Upgrade", "websocket");
  return response;
}

template <typename Reply>
Response JsonOrError(const absl::StatusOr<Reply>& reply) {
  return reply.ok() ? JsonReply(*reply) : ErrorReply(reply.status());
}

// "https://example.org:8443" -> "example.org:8443".
std::string_view HostOf(std::string_view origin) {
  const size_t slashes = origin.find("://");
  return slashes == std::string_view::npos ? origin : origin.substr(slashes + 3);
}

}  // namespace

server::Caller CallerOf(const Request& request) {
  server::Caller caller;
  caller.client = request.peer;
  caller.request_id = server::RequestIdOf(request.request_id);
  return caller;
}

struct Router::Call {
  Request request;
  Route route;
  std::vector<QueryField> fields;
  Done done;
  std::shared_ptr<Cancellation> cancellation = std::make_shared<Cancellation>();
  std::shared_ptr<server::Caller> caller;  // `done` tells the log of it
};

std::shared_ptr<Cancellation> Router::Answer(const Request& request, Done done) {
  const Target target = SplitTarget(request.target);
  Call call;
  call.request = request;
  call.route = FindRoute(target.path);
  call.caller = std::make_shared<server::Caller>(CallerOf(request));
  call.done = [this, request, caller = call.caller, watch = metrics::StopWatch(),
               done = std::move(done)](Response response) mutable {
    Complete(request, *caller, watch.Lap(), response);
    done(std::move(response));
  };
  std::shared_ptr<Cancellation> cancellation = call.cancellation;
  AnswerTo(std::move(call), target.path, target.query);
  return cancellation;
}

// A target may name a host, too.
absl::Status Router::CheckHosts(const Request& request) const {
  const absl::Status status = CheckHost(SplitTarget(request.target).host, options_.hosts);
  return status.ok() ? CheckHost(request.host, options_.hosts) : status;
}

void Router::AnswerTo(Call call, const std::string& path, const std::string& query) {
  const std::string& method = call.request.method;
  if (!IsForProbes(call.route.resource)) {
    const absl::Status verdict = CheckHosts(call.request);
    if (!verdict.ok()) return call.done(ErrorReply(verdict));
  }
  if (call.route.resource == Resource::kNone) return call.done(NoSuchPath(path));
  if (!IsKnownMethod(method)) return call.done(MethodNotAllowed(method));
  if (call.request.has_body) return call.done(BodyNotTaken());
  if (method == "OPTIONS") return call.done(Preflight());
  if (!IsForProbes(call.route.resource)) {
    server::StreamPermit permit;
    const absl::Status verdict =
        Admit(call.request, AccessRequestOf(call.route.resource), *call.caller, permit);
    if (!verdict.ok()) return call.done(ErrorReply(verdict));
  }
  absl::StatusOr<std::vector<QueryField>> fields = ParseQuery(query);
  if (!fields.ok()) return call.done(ErrorReply(fields.status()));
  call.fields = *std::move(fields);
  Dispatch(std::move(call));
}

// Adds what every answer has, counts it and logs it.
void Router::Complete(const Request& request, const server::Caller& caller, absl::Duration took,
                      Response& response) {
  const std::string path = SplitTarget(request.target).path;
  const std::string method = IsKnownMethod(request.method) ? request.method : "other";
  const std::string code = absl::StrCat(response.code);
  source_.metrics().CountRequest(
      {"http", absl::StrCat(method, " ", FindRoute(path).pattern), code, took});
  source_.call_log().Tell(EndedRequest(request, path, caller, response, took));
  response.headers.emplace_back("X-Request-Id", caller.request_id);
  response.headers.emplace_back("X-Content-Type-Options", "nosniff");
  if (!options_.allowed_origin.empty()) {
    response.headers.emplace_back("Access-Control-Allow-Origin", options_.allowed_origin);
    response.headers.emplace_back("Access-Control-Expose-Headers", kExposedHeaders);
  }
}

Response Router::Refused(const Request& request, const server::Caller& caller, Response response) {
  Complete(request, caller, absl::ZeroDuration(), response);
  return response;
}

void Router::NoteStream(const server::Caller& caller, int close_code, const std::string& reason,
                        absl::Duration took) {
  source_.metrics().CountRequest(
      {"http", absl::StrCat("GET ", kStreamPath), absl::StrCat(close_code), took});
  source_.call_log().Tell(EndedStream(kStreamPath, caller, close_code, reason, took));
}

absl::Status Router::Admit(const Request& request, const server::AccessRequest& access,
                           server::Caller& caller, server::StreamPermit& permit) {
  server::AccessGrant grant;
  const absl::Status verdict =
      source_.Admit({request.authorization, "", request.peer}, access, grant);
  caller.principal = std::move(grant.principal);
  if (server::IsKnown(caller.principal)) caller.client = caller.principal.name;
  permit = std::move(grant.permit);
  return verdict;
}

void Router::Dispatch(Call call) {
  switch (call.route.resource) {
    case Resource::kHealth:
      return call.done(TextReply("ok\n"));
    case Resource::kReady:
      return AnswerReady(std::move(call));
    case Resource::kMetrics:
      return AnswerMetrics(std::move(call));
    case Resource::kFamilies:
      return AnswerFamilies(std::move(call));
    case Resource::kFamily:
      return AnswerFamily(std::move(call));
    case Resource::kFrame:
      return AnswerFrame(std::move(call));
    case Resource::kStream:
      return call.done(UpgradeRequired());
    case Resource::kNone:
      return call.done(NoSuchPath(call.request.target));
  }
}

void Router::AnswerReady(Call call) {
  if (is_draining_) {
    return call.done(ErrorReply(server::ShuttingDown()));
  }
  source_.CheckStores([done = std::move(call.done)](absl::StatusOr<std::string> state) mutable {
    done(state.ok() ? TextReply(*state + "\n") : ErrorReply(state.status(), 503));
  });
}

void Router::AnswerMetrics(Call call) {
  source_.GetMetricsText([done = std::move(call.done)](absl::StatusOr<std::string> text) mutable {
    if (!text.ok()) return done(ErrorReply(text.status()));
    Response response = TextReply(*std::move(text));
    response.headers[0].second = kMetricsType;
    done(std::move(response));
  });
}

void Router::AnswerFamilies(Call call) {
  absl::StatusOr<v1::ListFamiliesRequest> request = ToListFamilies(call.fields);
  if (!request.ok()) return call.done(ErrorReply(request.status()));
  source_.ListFamilies(*std::move(request), [done = std::move(call.done)](auto reply) mutable {
    done(JsonOrError(reply));
  });
}

void Router::AnswerFamily(Call call) {
  absl::StatusOr<v1::GetFamilyRequest> request = ToGetFamily(call.route.family, call.fields);
  if (!request.ok()) return call.done(ErrorReply(request.status()));
  source_.GetFamily(*std::move(request), [done = std::move(call.done)](auto reply) mutable {
    done(JsonOrError(reply));
  });
}

void Router::AnswerFrame(Call call) {
  absl::StatusOr<v1::GetFrameRequest> request =
      ToGetFrame(call.route.family, call.fields, call.route.format);
  if (!request.ok()) return call.done(ErrorReply(request.status()));
  FrameAsk ask = {*std::move(request), call.request.if_none_match, call.caller->principal.key,
                  server::IsKnown(call.caller->principal)};
  FrameAnswer::Start(source_, std::move(ask), call.cancellation, std::move(call.done));
}

bool Router::IsStream(const Request& request) {
  return SplitTarget(request.target).path == kStreamPath;
}

absl::Status Router::AdmitStream(const Request& request, StreamVisit& visit) {
  const absl::Status host = CheckHosts(request);
  if (!host.ok()) return host;
  const std::string& allowed = options_.allowed_origin;
  if (!request.origin.empty() && allowed != "*" && request.origin != allowed &&
      HostOf(request.origin) != request.host) {
    return absl::PermissionDeniedError(absl::StrCat(
        "pages of ", EscapedPath(request.origin), " may not open streams here; see --http-origin"));
  }
  return Admit(request, {server::Scope::kFrames, true}, visit.caller, visit.permit);
}

}  // namespace liquidblend::http
