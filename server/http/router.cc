#include "server/http/router.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/request_id.h"
#include "server/http/answers/animation_frame_answer.h"
#include "server/http/answers/frame_answer.h"
#include "server/http/answers/method_answer.h"
#include "server/http/answers/upload_answer.h"
#include "server/http/answers/watch_answer.h"
#include "server/http/call_lines.h"
#include "server/http/exchange/host.h"
#include "server/http/exchange/protocols.h"
#include "server/http/exchange/replies.h"
#include "server/http/exchange/requests.h"
#include "server/transcode/query.h"

namespace liquidblend::http {
namespace {

constexpr char kStreamPath[] = "/v1/stream";
constexpr char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";
constexpr size_t kMaxShownPath = 80;
constexpr absl::string_view kCountedMethods[] = {"GET", "HEAD", "OPTIONS", "POST", "DELETE"};

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

bool IsForProbes(Resource resource) {
  return resource == Resource::kHealth || resource == Resource::kReady;
}

// The page has no data in it, and a token is typed into it.
bool IsForEverybody(Resource resource) {
  return IsForProbes(resource) || resource == Resource::kPage;
}

// Whether a page's browser sends such a request to another site only for what it answers.
bool OnlyReads(const std::string& method) {
  return method == "GET" || method == "HEAD" || method == "OPTIONS";
}

// What is traced: neither probes nor files of the page.
bool IsCall(Resource resource) {
  return resource == Resource::kFrame || resource == Resource::kAnimationFrame ||
         resource == Resource::kMethod;
}

// Of an answer's status, or of the code with which a WebSocket was closed: CloseCode(), or
// ClientCloseCode(), which never is one.
bool IsServerFault(int code) {
  constexpr int kNotImplemented = 501;  // clients ask for what not every store has
  return (code >= 500 && code < 600 && code != kNotImplemented) || (code >= 4500 && code < 4600);
}

// Attributes of a span at its end, by OpenTelemetry's conventions for HTTP.
void DescribeEnd(const server::Caller& caller, const std::string& resource, int code,
                 absl::string_view error) {
  const trace::Span& span = caller.span;
  if (!span.is_recording()) return;
  span.SetAttribute("http.response.status_code", code);
  span.SetAttribute("liquidblend.request_id", caller.request_id);
  span.SetAttribute("liquidblend.principal", caller.principal.name);
  if (!resource.empty()) span.SetAttribute("liquidblend.resource", resource);
  if (IsServerFault(code)) span.SetError(error);
}

server::AccessRequest AccessRequestOf(const Route& route) {
  const bool is_frame =
      route.resource == Resource::kFrame || route.resource == Resource::kAnimationFrame;
  if (is_frame) return {server::Scope::kFrames, false};
  if (route.method == nullptr) return {};
  return {route.method->scope, route.method->span == server::Span::kLasts};
}

Response NoSuchPath(const std::string& path) {
  return ErrorReply(absl::NotFoundError(absl::StrCat(
      "there is no path '", EscapedPath(path),
      "'; there are those of docs/http.md below /v1, /healthz, /readyz and /metrics")));
}

std::string AllowedText(const Route& route) {
  return absl::StrCat(absl::StrJoin(route.allowed, ", "), ", OPTIONS");
}

Response MethodNotAllowed(const std::string& method, const Route& route) {
  const std::string allowed = AllowedText(route);
  Response response =
      ErrorReply(absl::UnimplementedError(absl::StrCat(
                     "method ", EscapedPath(method), " is not for this path; there are ", allowed)),
                 405);
  response.headers.emplace_back("Allow", allowed);
  return response;
}

Response BodyNotTaken() {
  return ErrorReply(absl::InvalidArgumentError("a request here has no body"), 413);
}

Response Preflight(const Route& route) {
  Response response;
  response.code = 204;
  const std::string allowed = AllowedText(route);
  response.headers = {
      {"Allow", allowed},
      {"Access-Control-Allow-Methods", allowed},
      {"Access-Control-Allow-Headers",
       "Authorization, Content-Type, If-None-Match, X-Request-Id, Traceparent, Tracestate"},
      {"Access-Control-Max-Age", "86400"}};
  return response;
}

Response UpgradeRequired() {
  Response response = ErrorReply(
      absl::FailedPreconditionError("this path is a WebSocket: ask for an upgrade"), 426);
  response.headers.emplace_back("Upgrade", "websocket");
  return response;
}

}  // namespace

server::Caller CallerOf(const Request& request) {
  server::Caller caller;
  caller.client = request.peer;
  caller.request_id = server::RequestIdOf(request.request_id);
  return caller;
}

ExchangePtr Router::Answer(const Request& request, Exchange::Done done) {
  const Target target = SplitTarget(request.target);
  const auto exchange = std::make_shared<Exchange>(
      request, routes_.Find(request.method, target.path), CallerOf(request));
  exchange->SetDone([this, exchange = exchange.get(), watch = metrics::StopWatch(),
                     done = std::move(done)](Response response) mutable {
    done(Completed(*exchange, watch.Lap(), std::move(response)));
  });
  if (!Refuse(*exchange, target.path, target.query)) Dispatch(exchange);
  return exchange;
}

// A target may name a host, too.
absl::Status Router::CheckHosts(const Request& request) const {
  const absl::Status status = CheckHost(SplitTarget(request.target).host, options_.hosts);
  return status.ok() ? CheckHost(request.host, options_.hosts) : status;
}

// Answers what needs no caller to be known. True: that was it.
bool Router::RefuseUnasked(Exchange& exchange, const std::string& path) const {
  const Request& request = exchange.request;
  const Route& route = exchange.route;
  absl::Status verdict;
  if (!IsForProbes(route.resource)) verdict = CheckHosts(request);
  if (!verdict.ok()) {
    exchange.Fail(verdict);
  } else if (route.resource == Resource::kNone) {
    exchange.Finish(NoSuchPath(path));
  } else if (request.method == "OPTIONS") {
    exchange.Finish(request.has_body ? BodyNotTaken() : Preflight(route));
  } else if (!route.Allows(request.method)) {
    exchange.Finish(MethodNotAllowed(request.method, route));
  } else if (request.has_body && !route.takes_body()) {
    exchange.Finish(BodyNotTaken());
  } else if (!OnlyReads(request.method)) {
    verdict = CheckOrigin(request.origin, request.host, options_.allowed_origin);
    if (!verdict.ok()) exchange.Fail(verdict);
  }
  return exchange.is_finished();
}

bool Router::Refuse(Exchange& exchange, const std::string& path, const std::string& query) {
  if (RefuseUnasked(exchange, path)) return true;
  if (!IsForEverybody(exchange.route.resource)) {
    const absl::Status verdict =
        Admit(exchange.request, AccessRequestOf(exchange.route), exchange.caller, exchange.permit);
    const bool is_call = IsCall(exchange.route.resource) && !absl::IsUnauthenticated(verdict);
    if (is_call) exchange.caller.span = StartSpan(exchange.request, exchange.route.pattern);
    if (!verdict.ok()) exchange.Fail(verdict);
  }
  if (exchange.route.resource == Resource::kPage) return false;  // only the page reads its query
  absl::StatusOr<std::vector<transcode::QueryField>> fields = transcode::ParseQuery(query);
  if (!fields.ok()) exchange.Fail(fields.status());
  if (fields.ok()) exchange.fields = *std::move(fields);
  return exchange.is_finished();
}

// The answer as it goes out. If there is no memory for that, an empty one: the client waits.
Response Router::Completed(const Exchange& exchange, absl::Duration took,
                           Response response) noexcept {
  try {
    Hold(exchange, response);
    Complete(exchange, took, response);
    return response;
  } catch (...) {
    Response empty;
    empty.code = HttpCode(absl::StatusCode::kResourceExhausted);  // as of Guarded()
    empty.span = exchange.caller.span;
    return empty;
  }
}

// Takes the answer's memory from the budget, or refuses it.
void Router::Hold(const Exchange& exchange, Response& response) {
  if (response.body.empty()) return;
  response.memory = answers_->Hold(static_cast<int64_t>(response.body.size()));
  if (response.memory != nullptr) return;
  absl::Status error = server::TooManyAnswers();
  if (!exchange.resource.empty()) {
    error = server::WithMetadata(error, {{"resource", exchange.resource}});
  }
  response = ErrorReply(error);
}

// Adds what every answer has, counts it and logs it.
void Router::Complete(const Exchange& exchange, absl::Duration took, Response& response) {
  const std::string& sent = exchange.request.method;
  const bool is_counted = std::count(std::begin(kCountedMethods), std::end(kCountedMethods), sent);
  api_.metrics().CountRequest(
      {"http", absl::StrCat(is_counted ? sent : "other", " ", exchange.route.pattern),
       absl::StrCat(response.code), took});
  const std::string path = SplitTarget(exchange.request.target).path;
  api_.call_log().Tell(EndedRequest(exchange, path, response, took));
  DescribeEnd(exchange.caller, exchange.resource, response.code, response.error);
  response.span = exchange.caller.span;
  response.headers.emplace_back("X-Request-Id", exchange.caller.request_id);
  response.headers.emplace_back("X-Content-Type-Options", "nosniff");
  if (!options_.allowed_origin.empty()) {
    response.headers.emplace_back("Access-Control-Allow-Origin", options_.allowed_origin);
    response.headers.emplace_back("Access-Control-Expose-Headers", kExposedHeaders);
  }
}

Response Router::Refused(const Request& request, const server::Caller& caller, Response response) {
  const std::string path = SplitTarget(request.target).path;
  const Exchange exchange(request, routes_.Find(request.method, path), caller);
  Complete(exchange, absl::ZeroDuration(), response);
  return response;
}

void Router::NoteStream(const server::Caller& caller, int close_code, absl::string_view reason,
                        absl::Duration took) noexcept {
  server::RunGuarded("the end of a stream", [&] {
    api_.metrics().CountRequest(
        {"http", absl::StrCat("GET ", kStreamPath), absl::StrCat(close_code), took});
    api_.call_log().Tell(EndedStream(kStreamPath, caller, close_code, reason, took));
    DescribeEnd(caller, "", close_code, reason);
  });
  caller.span.End();
}

absl::Status Router::Admit(const Request& request, const server::AccessRequest& access,
                           server::Caller& caller, server::StreamPermit& permit) {
  server::AccessGrant grant;
  const absl::Status verdict = api_.Admit({request.authorization, "", request.peer}, access, grant);
  caller.principal = std::move(grant.principal);
  if (server::IsKnown(caller.principal)) caller.client = caller.principal.name;
  permit = std::move(grant.permit);
  return verdict;
}

trace::Span Router::StartSpan(const Request& request, const std::string& pattern) const {
  const trace::SpanContext parent = trace::ParseContext(request.traceparent, request.tracestate);
  if (!api_.tracer().is_on()) return trace::Span(parent);
  trace::Span span = api_.tracer().StartSpan(absl::StrCat(request.method, " ", pattern),
                                             trace::SpanKind::kServer, parent);
  span.SetAttribute("http.request.method", request.method);
  span.SetAttribute("http.route", pattern);
  return span;
}

void Router::Dispatch(const ExchangePtr& exchange) {
  switch (exchange->route.resource) {
    case Resource::kHealth:
      return exchange->Finish(TextReply("ok\n"));
    case Resource::kReady:
      return AnswerReady(exchange);
    case Resource::kMetrics:
      return AnswerMetrics(exchange);
    case Resource::kFrame:
      return AnswerFrame(exchange);
    case Resource::kAnimationFrame:
      return AnswerAnimationFrame(api_, exchange);
    case Resource::kPage:
      return exchange->FinishBy([&] {
        return page_.Reply(SplitTarget(exchange->request.target).path, exchange->request);
      });
    case Resource::kStream:
      return exchange->Finish(UpgradeRequired());
    case Resource::kMethod:
      return DispatchMethod(exchange);
    case Resource::kNone:
      return exchange->Finish(NoSuchPath(exchange->request.target));
  }
}

void Router::DispatchMethod(const ExchangePtr& exchange) {
  const server::Method& method = *exchange->route.method;
  if (server::IsSame(method, server::kWatchOperation)) return AnswerWatch(api_, exchange);
  if (server::IsSame(method, server::kUploadAnimation)) return AnswerUpload(api_, exchange);
  AnswerMethod(api_, exchange, options_.max_body_bytes, bodies_);
}

void Router::AnswerReady(const ExchangePtr& exchange) {
  if (is_draining_) return exchange->Fail(server::ShuttingDown());
  api_.CheckIsReady([exchange](absl::StatusOr<std::string> state) {
    if (!state.ok()) return exchange->Fail(state.status(), 503);
    exchange->Finish(TextReply(*state + "\n"));
  });
}

void Router::AnswerMetrics(const ExchangePtr& exchange) {
  api_.GetMetricsText([exchange](absl::StatusOr<std::string> text) {
    if (!text.ok()) return exchange->Fail(text.status());
    Response response = TextReply(*std::move(text));
    response.headers[0].second = kMetricsType;
    exchange->Finish(std::move(response));
  });
}

void Router::AnswerFrame(const ExchangePtr& exchange) {
  const Route& route = exchange->route;
  absl::StatusOr<v1::GetFrameRequest> request =
      ToGetFrame(route.family, exchange->fields, route.format);
  if (!request.ok()) return exchange->Fail(request.status());
  exchange->resource = server::ResourceOf(*request);
  const server::Principal& principal = exchange->caller.principal;
  FrameAsk ask = {*std::move(request), exchange->request.if_none_match, principal.key,
                  server::IsKnown(principal), exchange->caller.span};
  FrameAnswer::Start(api_, std::move(ask), exchange->cancellation,
                     [exchange](absl::StatusOr<Response> response) {
                       if (!response.ok()) return exchange->Fail(response.status());
                       exchange->Finish(*std::move(response));
                     });
}

bool Router::IsStream(const Request& request) const {
  return SplitTarget(request.target).path == kStreamPath;
}

absl::Status Router::AdmitStream(const Request& request, StreamVisit& visit) {
  if (is_draining_) return server::ShuttingDown();  // a proxy asks another server then
  const absl::Status host = CheckHosts(request);
  if (!host.ok()) return host;
  const absl::Status origin = CheckOrigin(request.origin, request.host, options_.allowed_origin);
  if (!origin.ok()) return origin;
  Request asked = request;
  visit.protocols = ParseProtocols(request.protocols);
  if (asked.authorization.empty() && !visit.protocols.token.empty()) {
    asked.authorization = absl::StrCat("Bearer ", visit.protocols.token);
  }
  const absl::Status verdict =
      Admit(asked, {server::Scope::kFrames, true}, visit.caller, visit.permit);
  if (!absl::IsUnauthenticated(verdict)) visit.caller.span = StartSpan(request, kStreamPath);
  return verdict;
}

}  // namespace liquidblend::http
