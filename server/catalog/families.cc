#include "server/catalog/families.h"

#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files.h"

namespace liquidblend::catalog {
namespace {

// The same status with the family's name in front. A blob or file that the catalog refers to and
// that is not there, or is no family file, is lost data.
absl::Status LoadError(const std::string& id, const absl::Status& status) {
  const bool is_loss = absl::IsNotFound(status) || absl::IsInvalidArgument(status);
  return absl::Status(is_loss ? absl::StatusCode::kDataLoss : status.code(),
                      absl::StrCat("family ", id, ": ", std::string(status.message())));
}

std::vector<std::unique_ptr<const LoadedLevel>> LevelsOf(const mesh::RegisteredFamily& family) {
  std::vector<std::unique_ptr<const LoadedLevel>> levels;
  levels.push_back(std::make_unique<LoadedLevel>(family));
  for (const mesh::RegisteredFamily& level : family.coarser_levels) {
    levels.push_back(std::make_unique<LoadedLevel>(level));
  }
  return levels;
}

absl::StatusOr<LoadedFamily::ParameterSpace> Triangulate(const mesh::ParameterSpace& space) {
  if (space.empty()) return LoadedFamily::ParameterSpace();
  LB_ASSIGN_OR_RETURN(parameters::Triangulation made, parameters::Triangulation::Make(space));
  return LoadedFamily::ParameterSpace(std::move(made));
}

}  // namespace

LoadedFamily::LoadedFamily(mesh::RegisteredFamily registered, ParameterSpace triangulated)
    : family(std::move(registered)),
      levels(LevelsOf(family)),
      grid(encode::GridOf(family)),
      parameter_space(std::move(triangulated)) {}

absl::Status FamiliesOptions::Validate() const {
  if (memory_budget_bytes >= 0) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("memory_budget_bytes is ", memory_budget_bytes, ", not at least 0"));
}

Families::Families(store::Catalog& catalog, store::BlobStore& blobs, const FamiliesOptions& options)
    : catalog_(catalog), blobs_(blobs), options_(options) {}

absl::StatusOr<std::shared_ptr<const LoadedFamily>> Families::Get(const std::string& id,
                                                                  int64_t version) {
  LB_ASSIGN_OR_RETURN(const store::pb::FamilyRecord record, FindPublished(id, version));
  bool is_mine = false;
  const EntryPtr entry = FindOrStartEntry(record, is_mine);
  if (is_mine) LoadInto(record, entry);
  absl::MutexLock lock(&mutex_);
  mutex_.Await(absl::Condition(&entry->is_done));
  if (!entry->error.ok()) return entry->error;
  entry->last_use = ++num_uses_;
  EvictIdle();
  return entry->loaded;
}

absl::StatusOr<store::pb::FamilyRecord> Families::FindPublished(const std::string& id,
                                                                int64_t version) {
  absl::StatusOr<store::pb::FamilyRecord> record = catalog_.GetFamily(id);
  if (absl::IsNotFound(record.status())) Forget(id);
  if (!record.ok()) return record.status();
  if (record->version() == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("family ", id, " has no published version yet"));
  }
  if (version != 0 && version != record->version()) {
    return absl::NotFoundError(absl::StrCat("family ", id, " has no version ", version,
                                            "; the published one is ", record->version()));
  }
  return record;
}

// The entry of the record's version; is_mine: it is new, and the caller must load it.
Families::EntryPtr Families::FindOrStartEntry(const store::pb::FamilyRecord& record,
                                              bool& is_mine) {
  absl::MutexLock lock(&mutex_);
  EntryPtr& entry = entries_[record.id()];
  is_mine = entry == nullptr || entry->version != record.version();
  if (is_mine) {
    entry = std::make_shared<Entry>();
    entry->version = record.version();
  }
  return entry;
}

void Families::LoadInto(const store::pb::FamilyRecord& record, const EntryPtr& entry) {
  // Those who wait must hear of it too if loading throws (std::bad_alloc).
  absl::StatusOr<std::shared_ptr<const LoadedFamily>> result =
      absl::ResourceExhaustedError(absl::StrCat("family ", record.id(), ": loading broke off"));
  const absl::Cleanup finish = [&] { Finish(record.id(), entry, std::move(result)); };
  result = Load(record);
}

absl::StatusOr<std::shared_ptr<const LoadedFamily>> Families::Load(
    const store::pb::FamilyRecord& record) {
  absl::StatusOr<std::shared_ptr<const store::Blob>> blob = blobs_.Open(record.blob());
  if (!blob.ok()) return LoadError(record.id(), blob.status());
  const auto file_bytes = static_cast<int64_t>((*blob)->bytes().size());
  absl::StatusOr<mesh::RegisteredFamily> family = store::OpenFamily(*std::move(blob), record.id());
  if (!family.ok()) return LoadError(record.id(), family.status());
  family->name = record.id();
  family->version = record.version();
  auto space = Triangulate(family->parameter_space);
  if (!space.ok()) return LoadError(record.id(), space.status());
  const auto loaded = std::make_shared<LoadedFamily>(*std::move(family), *std::move(space));
  loaded->size_bytes = file_bytes;
  for (const auto& level : loaded->levels) {
    loaded->size_bytes += level->index.size_bytes() + level->time_links.size_bytes();
  }
  return std::shared_ptr<const LoadedFamily>(loaded);
}

void Families::Finish(const std::string& id, const EntryPtr& entry,
                      absl::StatusOr<std::shared_ptr<const LoadedFamily>> result) {
  absl::MutexLock lock(&mutex_);
  if (result.ok()) {
    entry->loaded = *std::move(result);
  } else {
    entry->error = result.status();
    const auto it = entries_.find(id);
    if (it != entries_.end() && it->second == entry) entries_.erase(it);
  }
  entry->is_done = true;
}

void Families::Forget(const std::string& id) {
  absl::MutexLock lock(&mutex_);
  entries_.erase(id);
}

// Lets go of the least recently used families that nobody holds, until the rest fits.
void Families::EvictIdle() {
  while (SizeBytes() > options_.memory_budget_bytes) {
    auto oldest = entries_.end();
    for (auto it = entries_.begin(); it != entries_.end(); ++it) {
      const Entry& entry = *it->second;
      const bool is_idle =
          entry.loaded != nullptr && it->second.use_count() == 1 && entry.loaded.use_count() == 1;
      if (!is_idle) continue;
      if (oldest == entries_.end() || entry.last_use < oldest->second->last_use) oldest = it;
    }
    if (oldest == entries_.end()) return;
    entries_.erase(oldest);
  }
}

int64_t Families::SizeBytes() const {
  int64_t bytes = 0;
  for (const auto& [id, entry] : entries_) {
    if (entry->loaded != nullptr) bytes += entry->loaded->size_bytes;
  }
  return bytes;
}

int64_t Families::size_bytes() const {
  absl::MutexLock lock(&mutex_);
  return SizeBytes();
}

}  // namespace liquidblend::catalog
