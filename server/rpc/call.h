// What the streaming methods share: how a call lives, ends once, and ends when the server does.
#pragma once

#include <grpcpp/grpcpp.h>

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "server/rpc/grpc_status.h"

namespace liquidblend::rpc {

class OpenCall {
 public:
  virtual ~OpenCall() = default;
  // Ends the call with this status as soon as no write is under way; only the first end counts.
  virtual void Close(const absl::Status& status) = 0;
};

// The calls that may last, so that a server that stops can end them.  Threads: safe.
class OpenCalls {
 public:
  // A call that comes after CloseAll() is closed at once.
  void Add(const std::shared_ptr<OpenCall>& call);
  void Remove(const OpenCall* call);
  void CloseAll(const absl::Status& status);

 private:
  absl::Mutex mutex_;
  std::map<const OpenCall*, std::weak_ptr<OpenCall>> calls_ ABSL_GUARDED_BY(mutex_);
  std::optional<absl::Status> closed_ ABSL_GUARDED_BY(mutex_);
};

// Reactor: one of gRPC's server reactors. A Call keeps itself until OnDone(); tasks on other
// threads hold a shared_ptr to it.
template <typename Reactor>
class Call : public Reactor, public OpenCall, public std::enable_shared_from_this<Call<Reactor>> {
 public:
  explicit Call(OpenCalls& calls) : calls_(calls) {}

  // Makes a call of class Derived and lets it begin.
  template <typename Derived, typename... Args>
  static Derived* Start(Args&&... args) {
    const auto call = std::make_shared<Derived>(std::forward<Args>(args)...);
    Call& base = *call;
    base.self_ = call;
    base.calls_.Add(call);
    base.Begin();
    return call.get();
  }

  void Close(const absl::Status& status) final {
    absl::MutexLock lock(&mutex_);
    if (!end_.has_value()) end_ = status;
    FinishIfIdle();
  }

  void OnCancel() final { Close(absl::CancelledError("the client has cancelled the call")); }

  void OnDone() final {
    calls_.Remove(this);
    self_.reset();  // deletes this, unless a task still holds it
  }

 protected:
  virtual void Begin() = 0;  // the first thing that is called

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
    this->Finish(ToGrpcStatus(*end_));
  }

  OpenCalls& calls_;
  std::shared_ptr<Call> self_;
  absl::Mutex mutex_;
  std::optional<absl::Status> end_ ABSL_GUARDED_BY(mutex_);
  bool is_writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool is_finished_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace liquidblend::rpc
