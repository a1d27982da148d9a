// Interceptor of every gRPC call of ours: access control before its handler, log line and status
// after it.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/trace/tracer.h"
#include "server/access/access_controller.h"
#include "server/access/call_log.h"
#include "server/access/principal.h"
#include "server/api/methods.h"
#include "server/frames/unread_answers.h"

namespace liquidblend::server {

class CallInterceptor;
class OpenCalls;

// One call, from its access check to its end.  Threads: safe, but for Read() and set_resource(),
// which belong before End().
class Admission : public UnreadAnswers::Reader {
 public:
  ~Admission() override;

  // The error of a refused call, or OK.
  const absl::Status& verdict() const { return verdict_; }
  const Caller& caller() const { return caller_; }
  OpenCalls& calls() const { return calls_; }
  bool lasts() const { return method_.span == Span::kLasts; }

  // Reads the request, of at most the method's size, and sets the resource that it names.
  // Errors: Parse()'s, in byte_buffers.h.
  absl::Status Read(const grpc::ByteBuffer& bytes, google::protobuf::Message& request);

  // Sets the resource of the call, for errors and the log: animations/{id} and the like.
  void set_resource(std::string resource) { resource_ = std::move(resource); }

  std::string account() const override { return caller_.principal.key; }
  // Cancels the call.  Requires: the call's reactor calls OnDone().
  void GiveUp() override ABSL_LOCKS_EXCLUDED(mutex_);
  // Waits for a GiveUp() of another thread, and leaves later ones without effect. To be called in
  // the reactor's OnDone(), after which gRPC destroys what they need.
  void OnDone() ABSL_LOCKS_EXCLUDED(mutex_);

  // Ends the call: logs it, and returns the client's status. To be called once.
  grpc::Status End(const absl::Status& status);

 private:
  friend class CallInterceptor;
  Admission(grpc::CallbackServerContext& context, const Method& method, OpenCalls& calls,
            CallLog& log)
      : method_(method), calls_(calls), log_(log), begin_(absl::Now()), context_(&context) {}
  void Log(const absl::Status& status) const;
  void Describe(const absl::Status& status) const;

  const Method& method_;
  OpenCalls& calls_;
  CallLog& log_;
  CallInterceptor* interceptor_ = nullptr;  // counts the call; none: it came after Close()
  const absl::Time begin_;
  Caller caller_;
  std::string resource_;
  absl::Status verdict_;
  StreamPermit permit_;
  absl::Mutex mutex_;
  grpc::CallbackServerContext* context_ ABSL_GUARDED_BY(mutex_);  // null after OnDone()
  std::optional<std::thread::id> giving_up_ ABSL_GUARDED_BY(mutex_);
};

// Admits calls and keeps count of them, for an orderly end.  Threads: safe.
class CallInterceptor {
 public:
  // All outlive all calls.
  CallInterceptor(AccessController& access_controller, OpenCalls& calls, CallLog& log,
                  const trace::Tracer& tracer)
      : access_controller_(access_controller), calls_(calls), log_(log), tracer_(tracer) {}

  // From now on every call is refused: the server shuts down.
  void Close();

  // Waits until all calls that came before Close() are over, for as long as `patience`.
  void AwaitCalls(absl::Duration patience);

  // Sends the call's request id to the client in the header x-request-id. A call with a known
  // caller gets a span, which ends with the Admission. `method` must outlive the call.
  std::shared_ptr<Admission> Admit(grpc::CallbackServerContext& context, const Method& method);

 private:
  friend class Admission;
  bool BeginCall();  // false: closed
  void EndCall();
  absl::Status Decide(const grpc::CallbackServerContext& context, Admission& admission);
  trace::Span StartSpan(const grpc::CallbackServerContext& context,
                        const Admission& admission) const;

  AccessController& access_controller_;
  OpenCalls& calls_;
  CallLog& log_;
  const trace::Tracer& tracer_;
  absl::Mutex mutex_;
  bool is_closed_ ABSL_GUARDED_BY(mutex_) = false;
  int64_t num_calls_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace liquidblend::server
