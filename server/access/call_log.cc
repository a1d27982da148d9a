#include "server/access/call_log.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/access/authorizer.h"

namespace liquidblend::server {
namespace {

constexpr size_t kMaxClients = 1000;  // beyond, they are counted together
constexpr char kOthers[] = "others";

// The key by which clients are counted: the principal, or the host of one without a valid token.
std::string ClientOf(const Caller& caller) {
  return caller.principal.key.empty() ? HostOfPeer(caller.client) : caller.principal.key;
}

base::LogFields FieldsOf(const EndedCall& call) {
  base::LogFields fields = call.how;
  fields.emplace_back("ms", absl::StrFormat("%.1f", absl::ToDoubleMilliseconds(call.took)));
  fields.emplace_back("principal", call.caller.principal.name);
  fields.emplace_back("client", call.caller.client);
  fields.emplace_back("request_id", call.caller.request_id);
  const trace::SpanContext& context = call.caller.span.context();
  if (context.is_valid()) fields.emplace_back("trace_id", trace::TraceIdOf(context));
  if (!call.resource.empty()) fields.emplace_back("resource", call.resource);
  if (!call.error.empty()) fields.emplace_back("error", call.error);
  return fields;
}

}  // namespace

void CallLog::Tell(const EndedCall& call) {
  if (!base::IsLogged(call.level)) return;
  if (call.error.empty() || MayTell(call)) base::Log(call.level, "call", FieldsOf(call));
}

bool CallLog::MayTell(const EndedCall& call) {
  std::string client = ClientOf(call.caller);
  {
    absl::MutexLock lock(&mutex_);
    if (windows_.size() >= kMaxClients && !windows_.contains(client)) client = kOthers;
    Window& window = windows_[client];
    ++window.num_calls;
    if (window.num_calls > kMaxLines) {
      window.last = call.how;
      window.worst = std::max(window.worst, call.level);
      return false;
    }
    if (window.num_calls > 1) return true;
  }
  later_(kWindow, [this, client] { Close(client); });
  return true;
}

void CallLog::Close(const std::string& client) {
  Window window;
  {
    absl::MutexLock lock(&mutex_);
    const auto found = windows_.find(client);
    if (found == windows_.end()) return;
    window = std::move(found->second);
    windows_.erase(found);
  }
  const int64_t num_more = window.num_calls - kMaxLines;
  if (num_more <= 0) return;
  window.last.emplace_back("client", client);
  base::Log(window.worst, absl::StrCat(num_more, " more like this"), window.last);
}

void CallLog::Flush() {
  std::map<std::string, Window> windows;
  {
    absl::MutexLock lock(&mutex_);
    windows = windows_;
  }
  for (const auto& [client, window] : windows) Close(client);
}

base::LogLevel LevelOf(absl::StatusCode code, base::LogLevel if_ok) {
  switch (code) {
    case absl::StatusCode::kOk:
      return if_ok;
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnknown:
    case absl::StatusCode::kDataLoss:
      return base::LogLevel::kError;
    default:
      return base::LogLevel::kInfo;
  }
}

}  // namespace liquidblend::server
