#include "server/grpc/open_calls.h"

#include <vector>

namespace liquidblend::server {

void OpenCalls::Add(const std::shared_ptr<OpenCall>& call) {
  std::optional<absl::Status> closed;
  {
    absl::MutexLock lock(&mutex_);
    calls_[call.get()] = call;
    closed = closed_;
  }
  if (closed.has_value()) call->Close(*closed);
}

void OpenCalls::Remove(const OpenCall* call) {
  absl::MutexLock lock(&mutex_);
  calls_.erase(call);
}

void OpenCalls::CloseAll(const absl::Status& status) {
  std::vector<std::shared_ptr<OpenCall>> open;
  {
    absl::MutexLock lock(&mutex_);
    closed_ = status;
    for (const auto& [key, call] : calls_) {
      if (std::shared_ptr<OpenCall> alive = call.lock()) open.push_back(std::move(alive));
    }
  }
  for (const std::shared_ptr<OpenCall>& call : open) call->Close(status);
}

}  // namespace liquidblend::server
