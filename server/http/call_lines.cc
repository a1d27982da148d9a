#include "server/http/call_lines.h"

#include "absl/strings/str_cat.h"
#include "server/base/errors.h"
#include "server/http/exchange/replies.h"

namespace liquidblend::http {
namespace {

constexpr size_t kMaxMethod = 20;
constexpr size_t kMaxPath = 120;
constexpr int kBroken = 500;        // the server's own mistake
constexpr int kBrokenClose = 4500;  // of a WebSocket: CloseCode() of the same
constexpr int kNormalClose = 1000;
constexpr int kGoingAway = 1001;  // the client leaves the page, or the server stops
constexpr int kNoCode = 1005;     // closed by the client without a reason

server::EndedCall Ended(const std::string& method, const std::string& path, int status,
                        const server::Caller& caller, absl::Duration took) {
  server::EndedCall call;
  call.how = {{"method", server::CleanText(method, kMaxMethod)},
              {"path", server::CleanText(path, kMaxPath)},
              {"status", absl::StrCat(status)}};
  call.level = base::LogLevel::kDebug;
  call.took = took;
  call.caller = caller;
  return call;
}

// In words. What the client says must not look as if the server did.
std::string EndOf(int close_code, absl::string_view reason) {
  std::string end = server::CleanText(reason);
  if (close_code == kOtherClose) return absl::StrCat("closed by the client: '", end, "'");
  return end.empty() ? "the connection was lost" : end;
}

}  // namespace

server::EndedCall EndedRequest(const Exchange& exchange, const std::string& path,
                               const Response& response, absl::Duration took) {
  server::EndedCall call =
      Ended(exchange.request.method, path, response.code, exchange.caller, took);
  const server::Method* method = exchange.route.method;
  const bool has_changed = method != nullptr && method->effect == server::Effect::kChanges;
  if (has_changed) call.level = base::LogLevel::kInfo;
  call.resource = exchange.resource;
  if (response.error.empty()) return call;
  call.level = response.code == kBroken ? base::LogLevel::kError : base::LogLevel::kInfo;
  call.error = response.error;
  return call;
}

server::EndedCall EndedStream(const std::string& path, const server::Caller& caller, int close_code,
                              absl::string_view reason, absl::Duration took) {
  server::EndedCall call = Ended("GET", path, close_code, caller, took);
  if (close_code == kNormalClose || close_code == kGoingAway || close_code == kNoCode) return call;
  call.level = close_code == kBrokenClose ? base::LogLevel::kError : base::LogLevel::kInfo;
  call.error = EndOf(close_code, reason);
  return call;
}

}  // namespace liquidblend::http
