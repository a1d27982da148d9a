#include "server/base/operation_looks.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace liquidblend::server {
namespace {

// Long enough for a catalog that is being replaced.
constexpr absl::Duration kLookLimit = absl::Minutes(1);

absl::StatusOr<SeenOperationPtr> Look(const OperationLooks::Read& read) {
  auto seen = std::make_shared<SeenOperation>();
  LB_ASSIGN_OR_RETURN(seen->operation, read());
  seen->bytes = seen->operation.SerializeAsString();
  return seen;
}

}  // namespace

std::shared_ptr<OperationLook> OperationLooks::Of(const std::string& name, Read read) {
  if (std::shared_ptr<OperationLook> known = Find(name)) return known;
  // Without the lock: if there is no memory for the pointer's counts, it deletes the look, and
  // Forget() takes the lock. The same holds for the end of a look that came second, below. The
  // deleter has a name of its own that is not const: to copy it again might end the program.
  const std::shared_ptr<OperationLook> look(
      new OperationLook(lookers_, timers_, [read = std::move(read)] { return Look(read); },
                        {.name = "the catalog", .kept = interval_, .limit = kLookLimit}),
      [this, own_name = std::string(name)](OperationLook* ended) {
        delete ended;
        Forget(own_name);
      });
  absl::MutexLock lock(&mutex_);
  std::weak_ptr<OperationLook>& known = looks_[name];
  if (std::shared_ptr<OperationLook> other = known.lock()) return other;
  known = look;
  return look;
}

std::shared_ptr<OperationLook> OperationLooks::Find(const std::string& name) const {
  absl::MutexLock lock(&mutex_);
  const auto found = looks_.find(name);
  return found == looks_.end() ? nullptr : found->second.lock();
}

absl::Duration OperationLooks::Interval() const {
  const int num_intervals = (num_looks() + kMaxPerInterval - 1) / kMaxPerInterval;
  return interval_ * std::max(1, num_intervals);
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

}  // namespace liquidblend::server
