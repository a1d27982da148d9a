#include "server/grpc/admission.h"

#include <google/protobuf/message.h>
#include <grpc/grpc_security_constants.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "server/base/errors.h"
#include "server/base/request_id.h"
#include "server/grpc/byte_buffers.h"
#include "server/grpc/grpc_status.h"

namespace liquidblend::server {
namespace {

absl::string_view Header(const grpc::CallbackServerContext& context, const char* name) {
  const auto found = context.client_metadata().find(name);
  if (found == context.client_metadata().end()) return "";
  return absl::string_view(found->second.data(), found->second.size());
}

// The values of all headers of that name, joined.
std::string Headers(const grpc::CallbackServerContext& context, const char* name) {
  std::string values;
  const auto [begin, end] = context.client_metadata().equal_range(name);
  for (auto header = begin; header != end; ++header) {
    absl::StrAppend(&values, values.empty() ? "" : ",",
                    absl::string_view(header->second.data(), header->second.size()));
  }
  return values;
}

trace::SpanContext ParentOf(const grpc::CallbackServerContext& context) {
  const std::string traceparent = Headers(context, trace::kTraceparent);
  if (traceparent.empty()) return {};
  return trace::ParseContext(traceparent, Headers(context, trace::kTracestate));
}

// Codes that OpenTelemetry's conventions count as errors of the server's span. But for
// UNIMPLEMENTED: clients ask for urls of the object store, and do without them where there are
// none.
bool IsServerFault(absl::StatusCode code) {
  return code == absl::StatusCode::kUnknown || code == absl::StatusCode::kDeadlineExceeded ||
         code == absl::StatusCode::kInternal || code == absl::StatusCode::kUnavailable ||
         code == absl::StatusCode::kDataLoss;
}

// The subject of a client certificate that TLS has verified; empty if there is none.
std::string CertificateSubject(const grpc::CallbackServerContext& context) {
  const std::shared_ptr<const grpc::AuthContext> auth = context.auth_context();
  if (auth == nullptr || !auth->IsPeerAuthenticated()) return "";
  const std::vector<grpc::string_ref> values =
      auth->FindPropertyValues(GRPC_X509_SUBJECT_PROPERTY_NAME);
  return values.empty() ? "" : std::string(values[0].data(), values[0].size());
}

}  // namespace

Admission::~Admission() {
  caller_.span.End();
  if (interceptor_ != nullptr) interceptor_->EndCall();
}

absl::Status Admission::Read(const grpc::ByteBuffer& bytes, google::protobuf::Message& request) {
  LB_RETURN_IF_ERROR(Parse(bytes, method_.name, request, method_.max_request_bytes));
  set_resource(ResourceOf(request));
  return absl::OkStatus();
}

// gRPC may call OnDone() within TryCancel(), on this thread.
void Admission::GiveUp() {
  grpc::CallbackServerContext* context = nullptr;
  {
    absl::MutexLock lock(&mutex_);
    if (context_ == nullptr || giving_up_.has_value()) return;
    context = context_;
    giving_up_ = std::this_thread::get_id();
  }
  context->TryCancel();
  absl::MutexLock lock(&mutex_);
  giving_up_.reset();
}

void Admission::OnDone() {
  const auto is_free = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return !giving_up_.has_value() || giving_up_ == std::this_thread::get_id();
  };
  absl::MutexLock lock(&mutex_);
  mutex_.Await(absl::Condition(&is_free));
  context_ = nullptr;
}

grpc::Status Admission::End(const absl::Status& status) {
  permit_.reset();
  Log(status);
  Describe(status);
  if (resource_.empty()) return ToGrpcStatus(status);
  return ToGrpcStatus(WithMetadata(status, {{"resource", resource_}}));
}

void Admission::Log(const absl::Status& status) const {
  const bool has_changed = method_.effect == Effect::kChanges;
  EndedCall call;
  call.level = LevelOf(status.code(), has_changed ? base::LogLevel::kInfo : base::LogLevel::kDebug);
  if (!base::IsLogged(call.level)) return;
  call.how = {{"method", method_.name}, {"code", absl::StatusCodeToString(status.code())}};
  call.took = absl::Now() - begin_;
  call.caller = caller_;
  call.resource = resource_;
  if (!status.ok()) {
    call.error = status.message().empty() ? call.how[1].second : CleanText(status.message());
  }
  log_.Tell(call);
}

// Attributes of the span, by OpenTelemetry's conventions for gRPC.
void Admission::Describe(const absl::Status& status) const {
  const trace::Span& span = caller_.span;
  if (!span.is_recording()) return;
  span.SetAttribute("rpc.grpc.status_code", static_cast<int64_t>(status.code()));
  span.SetAttribute("liquidblend.request_id", caller_.request_id);
  span.SetAttribute("liquidblend.principal", caller_.principal.name);
  if (!resource_.empty()) span.SetAttribute("liquidblend.resource", resource_);
  if (IsServerFault(status.code())) span.SetError(CleanText(status.message()));
}

void CallInterceptor::Close() {
  absl::MutexLock lock(&mutex_);
  is_closed_ = true;
}

void CallInterceptor::AwaitCalls(absl::Duration patience) {
  const auto is_empty = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return num_calls_ == 0; };
  absl::MutexLock lock(&mutex_);
  mutex_.AwaitWithTimeout(absl::Condition(&is_empty), patience);
}

bool CallInterceptor::BeginCall() {
  absl::MutexLock lock(&mutex_);
  if (!is_closed_) ++num_calls_;
  return !is_closed_;
}

void CallInterceptor::EndCall() {
  absl::MutexLock lock(&mutex_);
  --num_calls_;
}

std::shared_ptr<Admission> CallInterceptor::Admit(grpc::CallbackServerContext& context,
                                                  const Method& method) {
  std::shared_ptr<Admission> admission(new Admission(context, method, calls_, log_));
  admission->caller_.request_id = RequestIdOf(Header(context, kRequestIdHeader));
  admission->caller_.client = context.peer();
  context.AddInitialMetadata(kRequestIdHeader, admission->caller_.request_id);
  if (BeginCall()) admission->interceptor_ = this;
  admission->verdict_ = Decide(context, *admission);
  const bool is_known = !absl::IsUnauthenticated(admission->verdict_);
  if (is_known) admission->caller_.span = StartSpan(context, *admission);
  return admission;
}

trace::Span CallInterceptor::StartSpan(const grpc::CallbackServerContext& context,
                                       const Admission& admission) const {
  const trace::SpanContext parent = ParentOf(context);
  if (!tracer_.is_on()) return trace::Span(parent);
  const std::string service = ServiceOf(admission.method_);
  trace::Span span = tracer_.StartSpan(absl::StrCat(service, "/", admission.method_.name),
                                       trace::SpanKind::kServer, parent, admission.begin_);
  span.SetAttribute("rpc.system", "grpc");
  span.SetAttribute("rpc.service", service);
  span.SetAttribute("rpc.method", admission.method_.name);
  return span;
}

absl::Status CallInterceptor::Decide(const grpc::CallbackServerContext& context,
                                     Admission& admission) {
  if (admission.interceptor_ == nullptr) return ShuttingDown();
  Caller& caller = admission.caller_;
  const std::string subject = CertificateSubject(context);
  const Method& method = admission.method_;
  AccessGrant grant;
  const absl::Status verdict =
      access_controller_.Admit({Header(context, "authorization"), subject, caller.client},
                               {method.scope, method.span == Span::kLasts}, grant);
  caller.principal = std::move(grant.principal);
  admission.permit_ = std::move(grant.permit);
  if (IsKnown(caller.principal)) caller.client = caller.principal.name;
  return verdict;
}

}  // namespace liquidblend::server
