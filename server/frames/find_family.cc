#include "server/frames/find_family.h"

#include <memory>
#include <utility>

#include "server/base/guarded.h"

namespace liquidblend::server {
namespace {

using liquidblend::catalog::AskedVersion;
using liquidblend::catalog::Families;
using liquidblend::catalog::FamilyPtr;

constexpr absl::Duration kFreshInterval = absl::Milliseconds(500);
constexpr absl::Duration kUsesInterval = absl::Minutes(1);

auto LoadsOf(Backends& backends) {
  return [&backends](Families::Task task) { return backends.loads.PostMore(std::move(task)); };
}

}  // namespace

void FindFamily(Backends& backends, const std::string& id, AskedVersion asked,
                Families::Done done) {
  const auto announce = [&backends, done = std::make_shared<Families::Done>(std::move(done))](
                            absl::StatusOr<FamilyPtr> found) {
    Families::Done once;
    std::swap(once, *done);
    if (once == nullptr) return;
    if (found.ok()) backends.frame_cache.Announce(**found);
    once(FromServer(std::move(found)));
  };
  if (FamilyPtr found = backends.families.Peek(id, asked)) return announce(std::move(found));
  const auto ask = [&backends, id, asked, announce] {
    // Waiting calls must get an answer even without memory.
    const absl::Status status = Guarded([&] {
      backends.families.GetReady(id, asked, LoadsOf(backends), announce);
      return absl::OkStatus();
    });
    if (!status.ok()) announce(status);
  };
  const absl::Status accepted = Guarded([&] { return backends.io.Post(ask); });
  if (!accepted.ok()) announce(accepted);
}

bool IsBehind(Backends& backends, const std::string& id, int64_t version) {
  return backends.families.IsBehind(id, version, LoadsOf(backends));
}

void KeepFamiliesFresh(Backends& backends) {
  backends.io.PostAfter(kFreshInterval, [&backends] {
    RunGuarded("refreshing families", [&] { backends.families.Refresh(LoadsOf(backends)); });
    KeepFamiliesFresh(backends);
  });
}

void KeepUsesRecorded(Backends& backends) {
  backends.io.PostAfter(kUsesInterval, [&backends] {
    RunGuarded("recording uses", [&] { backends.uses.Record(backends.catalog); });
    KeepUsesRecorded(backends);
  });
}

void RecordUses(Backends& backends) {
  backends.io.PostMore([&backends] { backends.uses.Record(backends.catalog); });
}

void Preload(Backends& backends, absl::Duration limit, absl::AnyInvocable<void()> when_over) {
  const auto post_to = [](WorkPool& pool) {
    return [&pool](Families::Task task) { return pool.PostMore(std::move(task)); };
  };
  backends.preloader->Start(post_to(backends.io), post_to(backends.loads), std::move(when_over));
  backends.steps.PostAfter(limit, [preloader = backends.preloader] { preloader->Stop(); });
}

}  // namespace liquidblend::server
