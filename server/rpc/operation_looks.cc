#include "server/rpc/operation_looks.h"

#include <algorithm>

#include "core/base/status_macros.h"
#include "server/rpc/backends.h"
#include "server/rpc/handlers.h"

namespace liquidblend::rpc {
namespace {

// As long as a catalog may take that is being replaced.
constexpr absl::Duration kLookLimit = absl::Minutes(1);

absl::StatusOr<SeenOperationPtr> LookAtOperation(Backends& backends, const std::string& name) {
  lro::GetOperationRequest request;
  request.set_name(name);
  auto seen = std::make_shared<SeenOperation>();
  LB_ASSIGN_OR_RETURN(seen->operation, GetOperation(backends, request));
  seen->bytes = seen->operation.SerializeAsString();
  return seen;
}

}  // namespace

std::shared_ptr<OperationLook> OperationLooks::Of(const std::string& name) {
  absl::MutexLock lock(&mutex_);
  std::weak_ptr<OperationLook>& known = looks_[name];
  if (std::shared_ptr<OperationLook> look = known.lock()) return look;
  std::shared_ptr<OperationLook> look(
      new OperationLook(
          backends_.io, backends_.steps,
          [&backends = backends_, name] { return LookAtOperation(backends, name); },
          {.name = "the catalog", .kept = backends_.limits.watch_interval, .limit = kLookLimit}),
      [this, name](OperationLook* ended) {
        delete ended;
        Forget(name);
      });
  known = look;
  return look;
}

absl::Duration OperationLooks::Interval() const {
  const int num_intervals = (num_looks() + kMaxPerInterval - 1) / kMaxPerInterval;
  return backends_.limits.watch_interval * std::max(1, num_intervals);
}

int OperationLooks::num_looks() const {
  absl::MutexLock lock(&mutex_);
  return static_cast<int>(looks_.size());
}

// Unless somebody asked for a new one meanwhile.
void OperationLooks::Forget(const std::string& name) {
  absl::MutexLock lock(&mutex_);
  const auto found = looks_.find(name);
  if (found != looks_.end() && found->second.expired()) looks_.erase(found);
}

}  // namespace liquidblend::rpc
