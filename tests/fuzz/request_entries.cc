// The fuzzers `tokens`, `upload` and `pages`: a file and requests that reach the store.
#include <stdlib.h>

#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "core/store/data_directory.h"
#include "server/access/token_file.h"
#include "server/api/upload.h"
#include "tests/fuzz/entries.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/require.h"

namespace liquidblend::fuzz {
namespace {

namespace fs = std::filesystem;

// A store in a folder in memory, removed at the end of the process.
class Store {
 public:
  Store() : path_((fs::exists("/dev/shm") ? "/dev/shm" : "/tmp") + std::string("/lb_fuzz_XXXXXX")) {
    Require(mkdtemp(path_.data()) != nullptr, "there is a temporary folder");
    Reset();
  }
  ~Store() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }

  // Begins with an empty store.
  void Reset() {
    catalog_ = nullptr;
    blobs_ = nullptr;
    for (const auto& entry : fs::directory_iterator(path_)) fs::remove_all(entry.path());
    catalog_ = *store::OpenSqliteCatalog(store::CatalogPath(path_));
    blobs_ = *store::OpenLocalBlobStore(path_, store::Durability::kCache);
  }

  store::Catalog& catalog() { return *catalog_; }
  store::BlobStore& blobs() { return *blobs_; }

 private:
  std::string path_;
  std::unique_ptr<store::Catalog> catalog_;
  std::unique_ptr<store::BlobStore> blobs_;
};

// An upload, and what has been accepted of it.
class UploadRun {
 public:
  explicit UploadRun(Store& store)
      : upload_({store.catalog(), store.blobs(), tally_}, SmallLimits()) {}

  static server::Limits SmallLimits() {
    server::Limits limits;
    limits.max_upload_files = 8;
    limits.max_upload_bytes = 2000;
    limits.max_chunk_bytes = 500;
    return limits;
  }

  // False: it was refused, which ends an upload.
  bool Add(const v1::UploadAnimationRequest& message) {
    const absl::Status status = upload_.Add(message);
    CheckError(status);
    if (!status.ok()) return false;
    if (message.has_file()) {
      name_ = message.file().name();
      Require(sizes_.emplace(name_, 0).second, "names of files are taken once");
    }
    num_bytes_ += static_cast<int64_t>(message.chunk().size());
    if (message.has_chunk()) sizes_[name_] += static_cast<int64_t>(message.chunk().size());
    const server::Limits limits = SmallLimits();
    Require(num_bytes_ <= limits.max_upload_bytes, "no more bytes than allowed are taken");
    Require(std::ssize(sizes_) <= limits.max_upload_files, "no more files than allowed are taken");
    return true;
  }

  bool Submit() {
    const absl::StatusOr<store::pb::JobRecord> job = upload_.Submit();
    CheckError(job.status());
    if (!job.ok()) return false;
    const auto& files = job->import_animation().files();
    Require(files.size() == std::ssize(sizes_), "a job has all files");
    for (const store::pb::SourceFile& file : files) {
      Require(file.name().find('/') == std::string::npos, "a file's name is no path");
      Require(sizes_.at(file.name()) == file.size_bytes(), "a job's files are whole");
    }
    return true;
  }

 private:
  static void CheckError(const absl::Status& status) {
    Require(status.ok() || !status.message().empty(), "a refusal says why");
    Require(!absl::IsInternal(status) && !absl::IsUnknown(status), "no client causes INTERNAL");
  }

  server::UploadTally tally_;
  server::Upload upload_;
  std::string name_;                      // of the file that chunks go to
  std::map<std::string, int64_t> sizes_;  // of the files, as far as they have come
  int64_t num_bytes_ = 0;
};

constexpr int kNumListed = 5;

void FillLists(store::Catalog& catalog) {
  for (int k = 0; k < kNumListed; ++k) {
    store::pb::AnimationRecord animation;
    animation.set_id(absl::StrCat("a", k));
    store::pb::JobRecord job;
    job.mutable_import_animation()->set_animation(animation.id());
    Require(catalog.SubmitImport(animation, job).ok(), "the store takes jobs");
  }
}

template <typename Record>
void CheckPage(const absl::StatusOr<store::Page<Record>>& page, int page_size) {
  Require(page.ok() || absl::IsInvalidArgument(page.status()), "a page token is taken or refused");
  if (!page.ok()) return Require(!page.status().message().empty(), "a refusal says why");
  std::set<std::string> ids;
  for (const Record& record : page->records) ids.insert(record.id());
  Require(ids.size() == page->records.size(), "a page lists nothing twice");
  Require(page_size <= 0 || std::ssize(ids) <= page_size, "a page has no more than asked for");
}

}  // namespace

// The file itself.
void RunTokens(std::span<const std::byte> bytes) {
  const std::string_view json = Input(bytes).Rest();
  const auto file = server::ParseTokenFile({json.data(), json.size()});
  if (!file.ok()) {
    Require(absl::IsInvalidArgument(file.status()), "a token file is taken or refused");
    return Require(!file.status().message().empty(), "a refusal says why");
  }
  std::set<std::string> names;
  std::set<server::TokenHash> hashes;
  for (const server::TokenEntry& entry : file->entries) {
    Require(names.insert(entry.principal.name).second, "names are unique");
    Require(server::IsKnown(entry.principal), "nobody is called as those that are not known");
    Require(entry.principal.limits.Validate().ok(), "limits are in range");
    for (const server::TokenHash& hash : entry.token_hashes) {
      Require(hashes.insert(hash).second, "a token is one principal's");
    }
  }
}

// Messages, each a uint16 size and as many bytes. The upload is submitted at the end.
void RunUpload(std::span<const std::byte> bytes) {
  static Store store;
  static int num_runs = 0;
  constexpr int kRunsOfStore = 2000;
  Input input(bytes);
  bool is_accepted = true;
  {
    UploadRun run(store);
    while (is_accepted && !input.empty()) {
      const std::string_view message = input.Take(input.Word());
      v1::UploadAnimationRequest request;
      if (!request.ParseFromArray(message.data(), static_cast<int>(message.size()))) continue;
      is_accepted = run.Add(request);
    }
    is_accepted = is_accepted && run.Submit();
  }
  // A job would change what the next run finds; files of broken uploads only take space.
  if (is_accepted || ++num_runs % kRunsOfStore == 0) store.Reset();
}

// uint8 which list, int8 page size, page token.
void RunPages(std::span<const std::byte> bytes) {
  static Store store;
  static const bool is_filled = (FillLists(store.catalog()), true);
  (void)is_filled;
  Input input(bytes);
  const int list = input.Byte() % 3;
  const int page_size = static_cast<int8_t>(input.Byte());
  const std::string token(input.Rest());
  if (list == 0) return CheckPage(store.catalog().ListAnimations(page_size, token), page_size);
  if (list == 1) return CheckPage(store.catalog().ListFamilies(page_size, token), page_size);
  CheckPage(store.catalog().ListJobs(page_size, token), page_size);
}

}  // namespace liquidblend::fuzz
