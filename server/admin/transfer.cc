#include "server/admin/transfer.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/posix_file.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/catalog/catalog_file.h"
#include "core/store/catalog/job_records.h"
#include "core/store/data_directory.h"
#include "server/admin/young_blobs.h"
#include "server/tar/tar.h"

namespace liquidblend::admin {
namespace {

constexpr char kCatalog[] = "catalog";  // the file's name
constexpr int kMaxSnapshots = 3;

class StringWriter : public store::BlobWriter {
 public:
  absl::Status Append(std::span<const std::byte> bytes) override {
    content.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return absl::OkStatus();
  }
  absl::StatusOr<store::BlobId> Commit() override { return store::BlobId(); }
  std::string content;
};

std::span<const std::byte> AsBytes(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

// Puts running jobs back into the queue, without counting their attempts.
void QueueAgain(store::CatalogContents& contents) {
  for (store::pb::JobRecord& job : contents.jobs) {
    if (job.state() != store::pb::JobRecord::RUNNING) continue;
    store::ReturnToQueue(absl::Now(), job);
    job.set_attempts(std::max(0, job.attempts() - 1));
  }
}

// The id that a blob has in an export. A file of an upload becomes a blob like all others.
absl::StatusOr<store::BlobId> ExportedId(const store::BlobId& id, store::BlobStore& blobs) {
  if (!store::IsUploadId(id)) return id;
  const store::BlobId content = store::ContentIdOf(id);
  if (store::HashKindOf(content) == store::HashKind::kSha256) return content;
  // An older client's: a client may have made its XXH3 equal to that of another blob.
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob, blobs.Open(id));
  store::BlobHasher hasher;
  hasher.Add(blob->bytes());
  LB_RETURN_IF_ERROR(blob->Check());
  return hasher.Id();
}

absl::Status NameByContent(store::BlobStore& blobs, store::CatalogContents& contents) {
  for (store::pb::JobRecord& job : contents.jobs) {
    if (!job.has_import_animation() || !store::IsUnfinished(job)) continue;
    for (store::pb::SourceFile& file : *job.mutable_import_animation()->mutable_files()) {
      LB_ASSIGN_OR_RETURN(*file.mutable_blob(), ExportedId(file.blob(), blobs));
    }
  }
  return absl::OkStatus();
}

// A snapshot of a catalog, and its blobs.
struct Snapshot {
  store::CatalogContents contents;
  std::map<store::BlobId, store::BlobId> blobs;  // id in the store -> id in the export
};

// Blobs of animations whose file is lost (found by Check()): their records are exported alone.
std::set<store::BlobId> LostBlobs(const store::CatalogContents& contents) {
  std::set<store::BlobId> lost;
  for (const store::pb::AnimationRecord& animation : contents.animations) {
    if (!store::NeedsBlob(animation)) lost.insert(animation.blob());
  }
  for (const store::pb::AnimationRecord& animation : contents.animations) {
    if (store::NeedsBlob(animation)) lost.erase(animation.blob());
  }
  return lost;
}

absl::StatusOr<Snapshot> TakeSnapshot(const store::Store& store) {
  LB_ASSIGN_OR_RETURN(store::CatalogInspection inspection, store.catalog->Inspect());
  if (!inspection.damage.empty()) {
    return absl::DataLossError(absl::StrCat(inspection.damage.front(), " (of ",
                                            inspection.damage.size(), " faults of the catalog)"));
  }
  Snapshot snapshot;
  snapshot.contents = std::move(inspection.contents);
  QueueAgain(snapshot.contents);
  LB_RETURN_IF_ERROR(NameByContent(*store.blobs, snapshot.contents));
  const std::set<store::BlobId> lost = LostBlobs(snapshot.contents);
  for (const store::BlobId& id : inspection.blobs) {
    if (lost.contains(id)) continue;
    LB_ASSIGN_OR_RETURN(snapshot.blobs[id], ExportedId(id, *store.blobs));
  }
  return snapshot;
}

// The blobs that records of a catalog file need. Only what such a file can hold is looked at, so a
// text that happens to look like a blob's id asks for one more.
std::vector<store::BlobId> BlobsOf(const store::CatalogContents& contents) {
  std::set<store::BlobId> needed;
  const auto add = [&](const google::protobuf::Message& record) {
    for (store::BlobId& id : store::BlobIdsIn(record)) needed.insert(std::move(id));
  };
  for (const auto& animation : contents.animations) {
    if (store::NeedsBlob(animation)) add(animation);
  }
  for (const auto& family : contents.families) add(family);
  for (const auto& kept : contents.kept_versions) add(kept);
  for (const auto& job : contents.jobs) {
    if (store::IsUnfinished(job) || !job.parent().empty()) add(job);
  }
  return std::vector<store::BlobId>(needed.begin(), needed.end());
}

// A blob to be copied: its ids here and there.
using BlobPair = std::pair<store::BlobId, store::BlobId>;

// Called with the id there and the size of each blob that was copied.  Threads: has to be safe.
using OnCopied = std::function<void(const store::BlobId&, int64_t size_bytes)>;

absl::Status CopyBlob(store::BlobStore& from, const BlobPair& ids, store::BlobStore& to,
                      int64_t* size_bytes) {
  LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob, from.Open(ids.first));
  *size_bytes = static_cast<int64_t>(blob->bytes().size());
  LB_RETURN_IF_ERROR(store::PutBlobAs(to, ids.second, blob->bytes()));
  return blob->Check();
}

// Copies those, several at a time; the first error in their order.
absl::Status CopyBlobs(store::BlobStore& from, const std::vector<BlobPair>& ids,
                       store::BlobStore& to, const parallel::Arena& arena, Progress& progress,
                       TransferReport& report, const OnCopied& on_copied = {}) {
  std::vector<absl::Status> statuses(ids.size());
  std::vector<int64_t> sizes(ids.size(), 0);
  std::atomic<bool> has_failed = false;
  arena.For(
      static_cast<int64_t>(ids.size()),
      [&](int64_t k) {
        if (has_failed) return;
        statuses[k] = CopyBlob(from, ids[k], to, &sizes[k]);
        if (!statuses[k].ok()) {
          has_failed = true;
        } else if (on_copied) {
          on_copied(ids[k].second, sizes[k]);
        }
        progress.Add(sizes[k]);
      },
      /*chunk_size=*/1);
  for (const absl::Status& status : statuses) LB_RETURN_IF_ERROR(status);
  report.num_copied += static_cast<int64_t>(ids.size());
  for (const int64_t size : sizes) report.copied_bytes += size;
  return absl::OkStatus();
}

void CountRecords(const store::CatalogContents& contents, TransferReport& report) {
  report.num_animations = static_cast<int64_t>(contents.animations.size());
  report.num_families = static_cast<int64_t>(contents.families.size());
  report.num_jobs = static_cast<int64_t>(contents.jobs.size());
}

// Hands snapshots to `copy` until all blobs of one could be copied: others may be replaced or
// deleted, and collected, meanwhile.
absl::StatusOr<Snapshot> CopySnapshot(const store::Store& store,
                                      absl::FunctionRef<absl::Status(const Snapshot&)> copy) {
  for (int attempt = 1;; ++attempt) {
    LB_ASSIGN_OR_RETURN(Snapshot snapshot, TakeSnapshot(store));
    const absl::Status status = copy(snapshot);
    if (status.ok()) return snapshot;
    if (!absl::IsNotFound(status)) return status;
    if (attempt == kMaxSnapshots) return absl::DataLossError(status.message());
  }
}

absl::StatusOr<std::string> CatalogFileOf(const Snapshot& snapshot, const std::string& name) {
  StringWriter writer;
  LB_RETURN_IF_ERROR(store::WriteCatalogFile(snapshot.contents, name, absl::Now(), writer));
  return std::move(writer.content);
}

absl::Status WriteFileDurably(const std::string& folder, const std::string& name,
                              const std::string& content) {
  const std::string path = absl::StrCat(folder, "/", name);
  const std::string temporary = absl::StrCat(path, ".new");
  LB_ASSIGN_OR_RETURN(const base::FileHandle file,
                      base::OpenFile(temporary, O_WRONLY | O_CREAT | O_TRUNC));
  LB_RETURN_IF_ERROR(base::WriteAll(file, AsBytes(content), temporary));
  LB_RETURN_IF_ERROR(base::Sync(file, temporary));
  if (std::rename(temporary.c_str(), path.c_str()) != 0) {
    return base::ErrnoStatus(errno, "rename to", path);
  }
  return base::SyncDirectory(folder);
}

absl::StatusOr<std::string> ReadWholeFile(const std::string& path) {
  LB_ASSIGN_OR_RETURN(const base::FileHandle file, base::OpenFile(path, O_RDONLY));
  struct stat info;
  if (fstat(file.fd(), &info) != 0) return base::ErrnoStatus(errno, "stat", path);
  std::string content;
  LB_RETURN_IF_ERROR(base::ReadAll(file, static_cast<size_t>(info.st_size), path, [&](auto bytes) {
    content.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }));
  return content;
}

absl::StatusOr<std::vector<store::BlobId>> MissingBlobs(const std::vector<store::BlobId>& needed,
                                                        YoungBlobs& young) {
  LB_RETURN_IF_ERROR(young.Refresh());
  std::vector<store::BlobId> missing;
  std::copy_if(needed.begin(), needed.end(), std::back_inserter(missing),
               [&](const store::BlobId& id) { return !young.SizeOf(id).has_value(); });
  return missing;
}

// A blob's id, if that is what the file's name says.
std::optional<store::BlobId> BlobOf(const std::string& name) {
  const std::string id = name.substr(name.rfind('/') + 1);
  if (store::IsBlobId(id) && absl::EndsWith(name, store::BlobKey(id))) return id;
  return std::nullopt;
}

absl::Status ImportBlob(tar::TarReader& archive, const store::BlobId& id, store::BlobStore& blobs) {
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<store::BlobWriter> writer, blobs.CreateAs(id));
  LB_RETURN_IF_ERROR(archive.Read([&](auto bytes) { return writer->Append(bytes); }));
  const absl::Status committed = writer->Commit().status();
  if (!absl::IsDataLoss(committed)) return committed;
  return absl::DataLossError(
      absl::StrCat("blob ", id, " of the archive is damaged: ", committed.message()));
}

// Copies the archive's blobs and returns its catalog.
absl::StatusOr<std::string> ReadArchive(tar::TarReader& archive, store::BlobStore& blobs,
                                        YoungBlobs& young, Progress& progress,
                                        TransferReport& report) {
  LB_RETURN_IF_ERROR(young.Refresh());
  std::string catalog;
  while (true) {
    LB_ASSIGN_OR_RETURN(const std::optional<tar::TarEntry> entry, archive.Next());
    if (!entry.has_value()) break;
    const std::string name = entry->name.substr(entry->name.rfind('/') + 1);
    if (name == kCatalog) {
      LB_RETURN_IF_ERROR(archive.Read([&](std::span<const std::byte> bytes) {
        catalog.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        return absl::OkStatus();
      }));
    }
    const std::optional<store::BlobId> id = BlobOf(entry->name);
    if (!id.has_value()) continue;
    progress.Add(entry->size_bytes);
    if (young.SizeOf(*id) == entry->size_bytes) {
      ++report.num_skipped;
      continue;
    }
    LB_RETURN_IF_ERROR(ImportBlob(archive, *id, blobs));
    young.Add(*id, entry->size_bytes);
    ++report.num_copied;
    report.copied_bytes += entry->size_bytes;
  }
  if (!catalog.empty()) return catalog;
  return absl::DataLossError("the archive has no catalog: it is not complete, or no export");
}

// Last: all blobs must be there.
absl::Status ImportRecords(const store::CatalogContents& contents, store::Catalog& catalog,
                           YoungBlobs& young, TransferReport& report) {
  LB_ASSIGN_OR_RETURN(const std::vector<store::BlobId> missing,
                      MissingBlobs(BlobsOf(contents), young));
  if (!missing.empty()) {
    return absl::DataLossError(absl::StrCat("the export has no blob ", missing.front(), " (of ",
                                            missing.size(), " missing)"));
  }
  CountRecords(contents, report);
  return catalog.Import(contents);
}

}  // namespace

absl::StatusOr<TransferReport> ExportToDirectory(const store::Store& store,
                                                 const std::string& directory,
                                                 const parallel::Arena& arena, Progress& progress) {
  struct stat info;
  if (stat(store::CatalogPath(directory).c_str(), &info) == 0) {
    return absl::FailedPreconditionError(
        absl::StrCat(directory, " is a data directory, no place for an export"));
  }
  LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(directory));
  TransferReport report;
  progress.Begin("exported", -1);
  LB_ASSIGN_OR_RETURN(
      const Snapshot snapshot, CopySnapshot(store, [&](const Snapshot& current) -> absl::Status {
        std::vector<BlobPair> missing;
        for (const BlobPair& ids : current.blobs) {
          if (!blobs->Verify(ids.second).ok()) missing.push_back(ids);
        }
        report.num_skipped = static_cast<int64_t>(current.blobs.size() - missing.size());
        return CopyBlobs(*store.blobs, missing, *blobs, arena, progress, report);
      }));
  progress.End();
  CountRecords(snapshot.contents, report);
  LB_ASSIGN_OR_RETURN(const std::string catalog, CatalogFileOf(snapshot, store.name));
  LB_RETURN_IF_ERROR(WriteFileDurably(directory, kCatalog, catalog));
  return report;
}

absl::StatusOr<TransferReport> ExportToStream(const store::Store& store, std::ostream& out,
                                              Progress& progress) {
  tar::TarWriter archive(out);
  TransferReport report;
  std::set<store::BlobId> written;
  progress.Begin("exported", -1);
  const auto copy = [&](const Snapshot& current) -> absl::Status {
    for (const auto& [id, exported] : current.blobs) {
      if (written.contains(exported)) continue;
      LB_ASSIGN_OR_RETURN(const std::shared_ptr<const store::Blob> blob, store.blobs->Open(id));
      LB_RETURN_IF_ERROR(archive.Add(store::BlobKey(exported), blob->bytes()));
      LB_RETURN_IF_ERROR(blob->Check());
      written.insert(exported);
      ++report.num_copied;
      report.copied_bytes += static_cast<int64_t>(blob->bytes().size());
      progress.Add(static_cast<int64_t>(blob->bytes().size()));
    }
    return absl::OkStatus();
  };
  LB_ASSIGN_OR_RETURN(const Snapshot snapshot, CopySnapshot(store, copy));
  progress.End();
  CountRecords(snapshot.contents, report);
  LB_ASSIGN_OR_RETURN(const std::string catalog, CatalogFileOf(snapshot, store.name));
  LB_RETURN_IF_ERROR(archive.Add(kCatalog, AsBytes(catalog)));
  LB_RETURN_IF_ERROR(archive.End());
  return report;
}

absl::StatusOr<TransferReport> ImportFromDirectory(const std::string& directory,
                                                   const store::Store& store,
                                                   const parallel::Arena& arena,
                                                   Progress& progress) {
  const std::string path = absl::StrCat(directory, "/", kCatalog);
  LB_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  LB_ASSIGN_OR_RETURN(const store::CatalogContents contents,
                      store::ReadCatalogFile(AsBytes(bytes), path));
  LB_RETURN_IF_ERROR(store.catalog->CheckImport(contents));
  LB_ASSIGN_OR_RETURN(const auto blobs, store::OpenLocalBlobStore(directory));
  const std::vector<store::BlobId> needed = BlobsOf(contents);
  TransferReport report;
  progress.Begin("imported", -1);
  YoungBlobs young(*store.blobs);
  LB_ASSIGN_OR_RETURN(std::vector<store::BlobId> missing, MissingBlobs(needed, young));
  report.num_skipped = static_cast<int64_t>(needed.size() - missing.size());
  while (!missing.empty()) {  // again what has become old while it took so long
    std::vector<BlobPair> pairs;
    for (const store::BlobId& id : missing) pairs.emplace_back(id, id);
    const absl::Status status =
        CopyBlobs(*blobs, pairs, *store.blobs, arena, progress, report,
                  [&](const store::BlobId& id, int64_t size_bytes) { young.Add(id, size_bytes); });
    if (absl::IsNotFound(status)) {
      return absl::DataLossError(absl::StrCat("the export is not complete: ", status.message()));
    }
    LB_RETURN_IF_ERROR(status);
    LB_ASSIGN_OR_RETURN(missing, MissingBlobs(needed, young));
  }
  progress.End();
  LB_RETURN_IF_ERROR(ImportRecords(contents, *store.catalog, young, report));
  return report;
}

absl::StatusOr<TransferReport> ImportFromStream(std::istream& in, const store::Store& store,
                                                Progress& progress) {
  tar::TarReader archive(in);
  TransferReport report;
  YoungBlobs young(*store.blobs);
  progress.Begin("imported", -1);
  LB_ASSIGN_OR_RETURN(const std::string bytes,
                      ReadArchive(archive, *store.blobs, young, progress, report));
  progress.End();
  LB_ASSIGN_OR_RETURN(const store::CatalogContents contents,
                      store::ReadCatalogFile(AsBytes(bytes), kCatalog));
  LB_RETURN_IF_ERROR(ImportRecords(contents, *store.catalog, young, report));
  return report;
}

}  // namespace liquidblend::admin
