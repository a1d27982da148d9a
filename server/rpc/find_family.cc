#include "server/rpc/find_family.h"

#include <memory>
#include <utility>

#include "server/rpc/guarded.h"

namespace liquidblend::rpc {
namespace {

using liquidblend::catalog::Families;
using liquidblend::catalog::FamilyPtr;

constexpr absl::Duration kFreshInterval = absl::Milliseconds(500);

auto LoadsOf(Backends& backends) {
  return [&backends](Families::Task task) { return backends.loads.PostMore(std::move(task)); };
}

}  // namespace

void FindFamily(Backends& backends, const std::string& id, int64_t version, Families::Done done) {
  const auto announce = [&backends, done = std::make_shared<Families::Done>(std::move(done))](
                            absl::StatusOr<FamilyPtr> found) {
    if (found.ok()) backends.frame_cache.Announce(**found);
    (*done)(FromServer(std::move(found)));
  };
  if (FamilyPtr found = backends.families.Peek(id, version)) return announce(std::move(found));
  const absl::Status accepted = backends.io.Post([&backends, id, version, announce] {
    backends.families.GetReady(id, version, LoadsOf(backends), announce);
  });
  if (!accepted.ok()) announce(accepted);
}

void KeepFamiliesFresh(Backends& backends) {
  backends.io.PostAfter(kFreshInterval, [&backends] {
    backends.families.Refresh(LoadsOf(backends));
    KeepFamiliesFresh(backends);
  });
}

}  // namespace liquidblend::rpc
