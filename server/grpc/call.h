// Base class of calls that stream, wait or take several steps: their lifetime, and their single
// end.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "server/base/guarded.h"
#include "server/grpc/admission.h"
#include "server/grpc/held_answer.h"
#include "server/grpc/open_calls.h"

namespace liquidblend::server {

// Reactor: one of gRPC's server reactors. A Call keeps itself until OnDone(); tasks on other
// threads hold a shared_ptr to it.
template <typename Reactor>
class Call : public Reactor, public OpenCall, public std::enable_shared_from_this<Call<Reactor>> {
 public:
  explicit Call(std::shared_ptr<Admission> admission) : admission_(std::move(admission)) {}

  // Makes a call of class Derived and lets it begin. A server that stops ends it if its method
  // lasts. Requires: it was admitted.
  template <typename Derived, typename... Args>
  static Derived* Start(Args&&... args) {
    const auto call = std::make_shared<Derived>(std::forward<Args>(args)...);
    Call& base = *call;
    base.self_ = call;
    if (base.admission_->lasts()) base.admission_->calls().Add(call);
    base.Attempt([&] { base.Begin(); });
    return call.get();
  }

  void Close(const absl::Status& status) final {
    absl::MutexLock lock(&mutex_);
    if (!end_.has_value()) end_ = status;
    FinishIfIdle();
  }

  void OnCancel() final { Close(absl::CancelledError("the client has cancelled the call")); }

  void OnDone() final {
    // gRPC calls this after OnCancel(), but ThreadSanitizer cannot see how.
    { const absl::MutexLock lock(&mutex_); }
    admission_->OnDone();
    admission_->calls().Remove(this);
    self_.reset();  // deletes this, unless a task still holds it
  }

 protected:
  virtual void Begin() = 0;  // the first thing that is called

  const Caller& caller() const { return admission_->caller(); }

  // Returns the bytes of an answer, as HoldAnswer().
  absl::StatusOr<grpc::ByteBuffer> Hold(Backends& backends, AnswerPtr bytes) {
    return HoldAnswer(backends, admission_, std::move(bytes));
  }

  // Cancels the call; any thread, at any time.
  void CancelCall() { admission_->GiveUp(); }

  // Sets the resource for errors and the log.
  void set_resource(std::string resource) {
    absl::MutexLock lock(&mutex_);
    if (!is_finished_) admission_->set_resource(std::move(resource));
  }

  // Runs work() for the call: an exception ends the call and not the thread.
  template <typename Work>
  void Attempt(Work&& work) {
    const absl::Status status = Guarded([&] {
      work();
      return absl::OkStatus();
    });
    if (!status.ok()) Close(status);
  }

  // Starts a read unless the call has ended.
  template <typename StartRead>
  void Read(StartRead&& start_read) {
    absl::MutexLock lock(&mutex_);
    if (!end_.has_value()) start_read();
  }

  // Starts a write unless the call has ended. Requires: no write is under way.
  template <typename StartWrite>
  void Write(StartWrite&& start_write) {
    absl::MutexLock lock(&mutex_);
    if (end_.has_value()) return;
    is_writing_ = true;
    start_write();
  }

  // To be called first in OnWriteDone(). False: the call has ended.
  bool EndWrite(bool ok) {
    absl::MutexLock lock(&mutex_);
    is_writing_ = false;
    if (!ok && !end_.has_value()) end_ = absl::CancelledError("the client has gone");
    FinishIfIdle();
    return !end_.has_value();
  }

  // Ends the call with OK and the response that `fill` sets, unless it has ended: then the response
  // and the context may be gone already.
  template <typename Fill>
  void Answer(Fill&& fill) {
    absl::MutexLock lock(&mutex_);
    if (end_.has_value()) return;
    fill();
    end_ = absl::OkStatus();
    FinishIfIdle();
  }

  // Whether the call has ended, or is about to end because its client is gone.
  bool is_abandoned(const grpc::CallbackServerContext& context) {
    absl::MutexLock lock(&mutex_);
    return end_.has_value() || context.IsCancelled();
  }

  bool has_ended() {
    absl::MutexLock lock(&mutex_);
    return end_.has_value();
  }

  bool is_writing() {
    absl::MutexLock lock(&mutex_);
    return is_writing_;
  }

 private:
  void FinishIfIdle() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (is_finished_ || is_writing_ || !end_.has_value()) return;
    is_finished_ = true;
    this->Finish(admission_->End(*end_));
  }

  const std::shared_ptr<Admission> admission_;
  std::shared_ptr<Call> self_;
  absl::Mutex mutex_;
  std::optional<absl::Status> end_ ABSL_GUARDED_BY(mutex_);
  bool is_writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_finished_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace liquidblend::server
