#include "server/catalog/families.h"

#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "core/base/log.h"
#include "core/base/retry.h"
#include "core/base/status_macros.h"

namespace liquidblend::catalog {
namespace {

constexpr int kMaxLooks = 3;  // at versions that are replaced before they can be loaded

absl::Status NoSuchVersion(const store::pb::FamilyRecord& published, AskedVersion asked) {
  const std::string missing = asked.exact != 0 ? absl::StrCat("version ", asked.exact)
                                               : absl::StrCat("version ", asked.at_least, " yet");
  return absl::NotFoundError(absl::StrCat("family ", published.id(), " has no ", missing,
                                          "; the published one is ", published.version()));
}

// The key of the slot of a version that is kept beside the published one. No id has an '@'.
std::string KeptSlot(const std::string& id, int64_t version) {
  return absl::StrCat(id, "@", version);
}

bool IsKeptSlot(const std::string& slot) { return absl::StrContains(slot, '@'); }

std::string FamilyOfSlot(const std::string& slot) { return slot.substr(0, slot.find('@')); }

bool IsSameVersion(const store::pb::FamilyRecord& a, const store::pb::FamilyRecord& b) {
  return a.version() == b.version() && a.blob() == b.blob();
}

// A family that was deleted and made again is another one.
bool IsSameFamily(const store::pb::FamilyRecord& a, const store::pb::FamilyRecord& b) {
  return a.create_time().seconds() == b.create_time().seconds() &&
         a.create_time().nanos() == b.create_time().nanos();
}

bool IsLaterVersion(const store::pb::FamilyRecord& later, const store::pb::FamilyRecord& earlier) {
  return later.version() > earlier.version() && IsSameFamily(later, earlier);
}

}  // namespace

absl::Status FamiliesOptions::Validate() const {
  if (memory_budget_bytes < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("memory_budget_bytes is ", memory_budget_bytes, ", not at least 0"));
  }
  if (transient_failure_patience >= absl::ZeroDuration()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("transient_failure_patience is ",
                                                 absl::FormatDuration(transient_failure_patience),
                                                 ", not at least 0"));
}

Families::Families(store::Catalog& catalog, store::BlobStore& blobs, const FamiliesOptions& options)
    : catalog_(catalog), blobs_(blobs), options_(options) {}

absl::StatusOr<FamilyPtr> Families::Get(const std::string& id, int64_t version) {
  absl::StatusOr<FamilyPtr> result;
  absl::Notification is_done;
  const auto run_here = [](Task task) {
    task();
    return true;
  };
  Find(id, version, Wish::kNewest, run_here, [&](absl::StatusOr<FamilyPtr> found) {
    result = std::move(found);
    is_done.Notify();
  });
  is_done.WaitForNotification();
  return result;
}

void Families::GetReady(const std::string& id, AskedVersion asked, Executor executor, Done done) {
  Find(id, asked, Wish::kReady, executor, std::move(done));
}

FamilyPtr Families::Peek(const std::string& id, AskedVersion asked) {
  absl::MutexLock lock(&mutex_);
  FamilyPtr found = PeekSlot(id, asked);
  if (found != nullptr || asked.exact == 0) return found;
  return PeekSlot(KeptSlot(id, asked.exact), asked);
}

FamilyPtr Families::PeekSlot(const std::string& key, AskedVersion asked) {
  const auto found = slots_.find(key);
  if (found == slots_.end() || found->second.current == nullptr) return nullptr;
  Slot& slot = found->second;
  if (!asked.Allows(slot.current->record.version())) return nullptr;
  if (!slot.current->loaded->CheckFile().ok()) return nullptr;
  slot.last_use = ++num_uses_;
  return slot.current->loaded;
}

bool Families::IsBehind(const std::string& id, int64_t version, Executor executor) {
  {
    absl::MutexLock lock(&mutex_);
    const auto found = slots_.find(id);
    if (found == slots_.end()) return false;
    const Slot& slot = found->second;
    const LoadPtr& current = slot.current;
    const LoadPtr& next = slot.next;
    if (current != nullptr && current->record.version() >= version) return false;
    const bool is_next = next != nullptr && next->record.version() >= version;
    if (is_next && current == nullptr) return false;  // all calls wait for it
    const bool has_failed = is_next && slot.failed_version == next->record.version();
    if (has_failed && !WillCatchUp(slot)) return false;
    if (is_next && !next->is_done) return true;
  }
  Find(id, 0, Wish::kRefresh, executor, [](const absl::StatusOr<FamilyPtr>&) {});
  return true;
}

// Whether the version whose load has failed is worth waiting for.
bool Families::WillCatchUp(const Slot& slot) const {
  const base::SteadyClock::time_point end =
      slot.failed_since + absl::ToChronoNanoseconds(options_.transient_failure_patience);
  return base::IsTransient(slot.failure) && base::SteadyClock::now() < end;
}

void Families::Refresh(Executor executor) {
  if (IsEmpty()) return;
  Dropped dropped;
  {
    absl::MutexLock lock(&mutex_);
    EvictIdle(dropped);
  }
  const auto versions = catalog_.ListFamilyVersions();
  NoteRefresh(versions.status());
  if (!versions.ok()) return;
  for (const std::string& id : ChangedSlots(*versions)) {
    Find(id, 0, Wish::kRefresh, executor, [](const absl::StatusOr<FamilyPtr>&) {});
  }
  ForgetUnkeptVersions();
  DropMinVersions(*versions);
}

// Removes the entries of families that were deleted, or whose store was restored from a backup.
void Families::DropMinVersions(const std::map<std::string, int64_t>& versions) {
  absl::MutexLock lock(&mutex_);
  std::erase_if(min_versions_, [&](const auto& entry) {
    const auto found = versions.find(entry.first);
    return found == versions.end() || found->second < entry.second;
  });
}

void Families::ForgetUnkeptVersions() {
  std::vector<std::string> held;
  {
    absl::MutexLock lock(&mutex_);
    for (const auto& [key, slot] : slots_) {
      if (IsKeptSlot(key)) held.push_back(key);
    }
  }
  if (held.empty()) return;
  const absl::StatusOr<store::KeptVersions> kept = catalog_.ListKeptNumbers();
  if (!kept.ok()) return;
  for (const auto& [id, versions] : *kept) {
    for (const int64_t version : versions) std::erase(held, KeptSlot(id, version));
  }
  std::vector<Slot> dropped;  // without the lock
  absl::MutexLock lock(&mutex_);
  for (const std::string& key : held) {
    const auto found = slots_.find(key);
    if (found == slots_.end()) continue;
    dropped.push_back(std::move(found->second));
    slots_.erase(found);
  }
}

void Families::NoteRefresh(const absl::Status& status) {
  absl::MutexLock lock(&mutex_);
  if (std::exchange(is_catalog_away_, !status.ok()) != status.ok()) return;
  if (status.ok()) {
    base::LogInfo("the catalog answers again: families in memory are refreshed");
  } else {
    base::LogError("cannot refresh families in memory, they are served unchanged: " +
                   status.ToString());
  }
}

bool Families::IsEmpty() const {
  absl::MutexLock lock(&mutex_);
  return slots_.empty() && min_versions_.empty();
}

// Slots whose version differs from the served one, or whose family was deleted.
std::vector<std::string> Families::ChangedSlots(
    const std::map<std::string, int64_t>& versions) const {
  std::vector<std::string> ids;
  absl::MutexLock lock(&mutex_);
  for (const auto& [id, slot] : slots_) {
    if (IsKeptSlot(id)) continue;
    const auto found = versions.find(id);
    const bool is_served = slot.current != nullptr && found != versions.end() &&
                           found->second == slot.current->record.version();
    if (!is_served) ids.push_back(id);
  }
  return ids;
}

void Families::Find(const std::string& id, AskedVersion asked, Wish wish, Executor executor,
                    Done done) {
  const absl::StatusOr<Wanted> wanted = FindWanted(id, asked);
  if (!wanted.ok()) return done(wanted.status());
  ForgetNamesake(wanted->record);
  Choice choice;
  Dropped dropped;
  // Waiting calls must get an answer even if an exception is thrown (std::bad_alloc).
  absl::Cleanup drop = [&] {
    if (choice.start == nullptr) return;
    Finish(choice.start,
           absl::UnavailableError(absl::StrCat(
               "family ", id, ": not loaded, the server is shutting down or out of memory")));
  };
  {
    absl::MutexLock lock(&mutex_);
    // A version that was published a moment ago may still be in the family's own slot.
    if (IsKeptSlot(wanted->slot)) choice.ready = PeekSlot(id, asked);
    if (choice.ready == nullptr) choice = Choose(*wanted, asked, wish);
    if (choice.wait != nullptr) choice.wait->waiting.push_back({asked, std::move(done)});
    EvictIdle(dropped);
  }
  const bool is_started =
      choice.start == nullptr || executor([this, load = choice.start] { Run(load); });
  if (is_started) std::move(drop).Cancel();
  if (!choice.error.ok()) return done(choice.error);
  if (choice.ready != nullptr) done(std::move(choice.ready));
}

absl::StatusOr<store::pb::FamilyRecord> Families::FindPublished(const std::string& id) {
  absl::StatusOr<store::pb::FamilyRecord> record = catalog_.GetFamily(id);
  if (absl::IsNotFound(record.status())) Forget(id);
  if (!record.ok()) return record.status();
  if (record->version() == 0) {
    Forget(id);  // what is in memory is of a deleted family of that name
    const std::string& reason = record->failed_registration().error().message();
    return absl::FailedPreconditionError(absl::StrCat(
        "family ", id, " has no published version yet",
        record->has_failed_registration() ? "; its registration ended with: " : "", reason));
  }
  return record;
}

absl::StatusOr<Families::Wanted> Families::FindWanted(const std::string& id, AskedVersion asked) {
  LB_ASSIGN_OR_RETURN(store::pb::FamilyRecord published, FindPublished(id));
  const int64_t version = asked.exact;
  if (version == 0 || version == published.version()) return Wanted{id, std::move(published)};
  absl::StatusOr<store::pb::FamilyRecord> kept = catalog_.GetFamilyVersion(id, version);
  if (absl::IsNotFound(kept.status())) return Wanted{id, std::move(published)};
  if (!kept.ok()) return kept.status();
  return Wanted{KeptSlot(id, version), *std::move(kept)};
}

// A family that was deleted is not served until its namesake is ready.
void Families::ForgetNamesake(const store::pb::FamilyRecord& record) {
  {
    absl::MutexLock lock(&mutex_);
    const auto found = slots_.find(record.id());
    if (found == slots_.end() || found->second.current == nullptr) return;
    const store::pb::FamilyRecord& served = found->second.current->record;
    if (record.version() <= served.version() || IsSameFamily(record, served)) return;
  }
  Forget(record.id());
}

// The served version stays until its successor is loaded.
Families::Choice Families::Choose(const Wanted& wanted, AskedVersion asked, Wish wish) {
  Choice choice;
  const store::pb::FamilyRecord& record = wanted.record;
  const auto found = slots_.find(wanted.slot);
  LoadPtr current = found == slots_.end() ? nullptr : found->second.current;
  if (current != nullptr && !current->loaded->CheckFile().ok()) current = nullptr;  // load it anew
  const LoadPtr next = found == slots_.end() ? nullptr : found->second.next;
  if (wish == Wish::kRefresh && current == nullptr && next == nullptr) {
    return choice;  // let go meanwhile
  }
  const bool is_current = current != nullptr && IsSameVersion(current->record, record);
  const bool may_go_on = current != nullptr && wish != Wish::kNewest &&
                         IsLaterVersion(record, current->record) &&
                         asked.Allows(current->record.version());
  // Someone else has loaded a later version since `record` was read.
  if (current != nullptr && IsLaterVersion(current->record, record)) {
    return ChooseCurrent(current, asked);
  }
  if (!may_go_on && !asked.Allows(record.version())) {
    choice.error = NoSuchVersion(record, asked);
    return choice;
  }
  Slot& slot = slots_[wanted.slot];
  if (wish != Wish::kRefresh) slot.last_use = ++num_uses_;
  if (is_current) {
    choice.ready = current->loaded;
    return choice;
  }
  const bool is_next =
      next != nullptr &&
      (IsSameVersion(next->record, record) || IsLaterVersion(next->record, record)) &&
      (!next->is_done || (may_go_on && base::SteadyClock::now() < next->retry_at));
  if (!is_next) {
    choice.start = std::make_shared<Load>();
    choice.start->slot = wanted.slot;
    choice.start->record = record;
    slot.next = choice.start;
  }
  if (may_go_on) {
    choice.ready = current->loaded;
  } else if (wish != Wish::kRefresh) {
    choice.wait = slot.next;
  }
  return choice;
}

Families::Choice Families::ChooseCurrent(const LoadPtr& current, AskedVersion asked) {
  Choice choice;
  if (asked.Allows(current->record.version())) {
    choice.ready = current->loaded;
  } else {
    choice.error = NoSuchVersion(current->record, asked);
  }
  return choice;
}

void Families::Run(const LoadPtr& load) {
  // Waiting calls must get an answer even if loading throws (std::bad_alloc).
  absl::StatusOr<FamilyPtr> result = absl::ResourceExhaustedError(
      absl::StrCat("family ", load->record.id(), ": loading broke off"));
  const absl::Cleanup finish = [&] { Finish(load, result); };
  result = LoadPublished(load);
}

// A version that is replaced before its file is opened may have been collected by then: its
// successor is loaded instead.
absl::StatusOr<FamilyPtr> Families::LoadPublished(const LoadPtr& load) {
  store::pb::FamilyRecord record = load->record;
  for (int attempt = 1;; ++attempt) {
    absl::StatusOr<FamilyPtr> loaded = LoadFamily(record, blobs_);
    if (!absl::IsDataLoss(loaded.status()) || attempt == kMaxLooks) return loaded;
    LB_ASSIGN_OR_RETURN(store::pb::FamilyRecord again, LookAgain(*load));
    if (IsSameVersion(again, record)) return loaded;
    record = std::move(again);
    absl::MutexLock lock(&mutex_);
    load->record = record;
  }
}

absl::StatusOr<store::pb::FamilyRecord> Families::LookAgain(const Load& load) {
  const std::string id = FamilyOfSlot(load.slot);
  if (!IsKeptSlot(load.slot)) return FindPublished(id);
  return catalog_.GetFamilyVersion(id, load.record.version());
}

void Families::Finish(const LoadPtr& load, const absl::StatusOr<FamilyPtr>& result) {
  Dropped dropped;
  std::vector<Waiter> waiting;
  {
    absl::MutexLock lock(&mutex_);
    waiting.swap(load->waiting);
    Settle(load, result, dropped);
  }
  if (!result.ok() && waiting.empty()) base::LogError(result.status().ToString());
  for (Waiter& waiter : waiting) {
    const bool is_asked_for = waiter.asked.Allows(load->record.version());
    result.ok() && !is_asked_for ? waiter.done(NoSuchVersion(load->record, waiter.asked))
                                 : waiter.done(result);
  }
}

// A load that was overtaken by a newer version serves only those who wait for it.
void Families::Settle(const LoadPtr& load, const absl::StatusOr<FamilyPtr>& result,
                      Dropped& dropped) {
  load->is_done = true;
  const auto found = slots_.find(load->slot);
  if (found == slots_.end() || found->second.next != load) return;
  Slot& slot = found->second;
  const bool is_served = result.ok() && !IsOutdated(*load);
  if (is_served) {
    load->loaded = *result;
    if (slot.current != nullptr) dropped.push_back(std::move(slot.current->loaded));
    slot.current = std::exchange(slot.next, nullptr);
    slot.failed_version = 0;
    EvictIdle(dropped);
  } else if (slot.current == nullptr) {
    slots_.erase(found);
  } else if (result.ok()) {
    slot.next = nullptr;
  } else {
    NoteFailure(*load, result.status(), slot);
  }
}

void Families::NoteFailure(Load& load, const absl::Status& error, Slot& slot) {
  const base::SteadyClock::time_point now = base::SteadyClock::now();
  slot.failure = error;
  load.retry_at = now + absl::ToChronoNanoseconds(kRetryPause);
  if (std::exchange(slot.failed_version, load.record.version()) != load.record.version()) {
    slot.failed_since = now;
  }
}

// Whether the record was read before the family was rolled back.
bool Families::IsOutdated(const Load& load) const {
  const auto found = min_versions_.find(load.slot);  // of kept versions there is none
  return found != min_versions_.end() && load.record.version() < found->second;
}

void Families::Forget(const std::string& id, int64_t min_version) {
  std::vector<Slot> dropped;  // without the lock
  absl::MutexLock lock(&mutex_);
  if (min_version > 0) min_versions_[id] = min_version;
  for (auto it = slots_.begin(); it != slots_.end();) {
    const auto slot = it++;
    if (FamilyOfSlot(slot->first) != id) continue;
    dropped.push_back(std::move(slot->second));
    slots_.erase(slot);
  }
}

// Lets go of the least recently used families that nobody holds, until the rest fits.
void Families::EvictIdle(Dropped& dropped) {
  while (SizeBytes() > options_.memory_budget_bytes) {
    auto oldest = slots_.end();
    for (auto it = slots_.begin(); it != slots_.end(); ++it) {
      const Slot& slot = it->second;
      const bool is_loading = slot.next != nullptr && !slot.next->is_done;
      const bool is_idle =
          !is_loading && slot.current != nullptr && slot.current->loaded.use_count() == 1;
      if (!is_idle) continue;
      if (oldest == slots_.end() || slot.last_use < oldest->second.last_use) oldest = it;
    }
    if (oldest == slots_.end()) return;
    dropped.push_back(std::move(oldest->second.current->loaded));
    slots_.erase(oldest);
  }
}

int64_t Families::SizeBytes() const {
  int64_t bytes = 0;
  for (const auto& [id, slot] : slots_) {
    if (slot.current != nullptr) bytes += slot.current->loaded->size_bytes;
  }
  return bytes;
}

std::map<std::string, int64_t> Families::SizesBytes() const {
  absl::MutexLock lock(&mutex_);
  std::map<std::string, int64_t> sizes;
  for (const auto& [id, slot] : slots_) {
    if (slot.current != nullptr) sizes[FamilyOfSlot(id)] += slot.current->loaded->size_bytes;
  }
  return sizes;
}

int64_t Families::size_bytes() const {
  absl::MutexLock lock(&mutex_);
  return SizeBytes();
}

}  // namespace liquidblend::catalog
