// Blobs of another store that answer nothing while they hang, as an object store that takes
// connections and says no more.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::server {

// Gives urls that lead nowhere, and knows of files that were sent directly, of three bytes each.
class HangingBlobs final : public store::BlobStore {
 public:
  explicit HangingBlobs(store::BlobStore& blobs) : blobs_(blobs) {}
  ~HangingBlobs() override { Release(); }

  void Hang() {
    absl::MutexLock lock(&mutex_);
    hangs_ = true;
  }
  void Release() {
    absl::MutexLock lock(&mutex_);
    hangs_ = false;
  }
  int num_opened() const { return num_opened_; }

  // Waits until so many calls hang. False: they do not within a while.
  bool AwaitHanging(int count) {
    const auto is_so = [&]()
                           ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return num_hanging_ >= count; };
    absl::MutexLock lock(&mutex_);
    return mutex_.AwaitWithTimeout(absl::Condition(&is_so), absl::Seconds(20));
  }

  absl::StatusOr<std::shared_ptr<const store::Blob>> Open(const store::BlobId& id) override {
    ++num_opened_;
    return Await().Open(id);
  }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> Create() override { return Await().Create(); }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateAs(const store::BlobId& id) override {
    return Await().CreateAs(id);
  }
  absl::StatusOr<std::unique_ptr<store::BlobWriter>> CreateUpload() override {
    auto writer = Await().CreateUpload();
    if (!writer.ok()) return writer.status();
    return std::make_unique<Writer>(*this, *std::move(writer));
  }
  absl::Status Verify(const store::BlobId& id) override { return Await().Verify(id); }
  absl::Status Delete(const store::BlobId& id) override { return Await().Delete(id); }
  absl::StatusOr<bool> DeleteIfNotNewer(const store::BlobId& id, absl::Time time) override {
    return Await().DeleteIfNotNewer(id, time);
  }
  absl::StatusOr<std::string> Quarantine(const store::BlobId& id) override {
    return Await().Quarantine(id);
  }
  absl::StatusOr<std::vector<store::BlobInfo>> List() override { return Await().List(); }
  absl::StatusOr<std::string> ReadCatalogId() override { return Await().ReadCatalogId(); }
  absl::Status WriteCatalogId(const std::string& id) override { return Await().WriteCatalogId(id); }
  absl::StatusOr<store::DirectUpload> PresignUpload(const store::BlobId& content, int64_t,
                                                    absl::Duration) override {
    Await();
    return store::DirectUpload{content + "-" + std::string(32, '0'), 3, {"http://x"}, {}, "", ""};
  }
  absl::StatusOr<std::string> PresignDownload(const store::BlobId&, absl::Duration) override {
    Await();
    return std::string("http://x");
  }
  absl::StatusOr<int64_t> SizeOfUpload(const store::BlobId&) override {
    Await();
    return 3;
  }

 private:
  class Writer final : public store::BlobWriter {
   public:
    Writer(HangingBlobs& blobs, std::unique_ptr<store::BlobWriter> writer)
        : blobs_(blobs), writer_(std::move(writer)) {}
    absl::Status Append(std::span<const std::byte> bytes) override {
      blobs_.Await();
      return writer_->Append(bytes);
    }
    absl::StatusOr<store::BlobId> Commit() override {
      blobs_.Await();
      return writer_->Commit();
    }

   private:
    HangingBlobs& blobs_;
    const std::unique_ptr<store::BlobWriter> writer_;
  };

  store::BlobStore& Await() {
    const auto goes_on = [this]() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return !hangs_; };
    absl::MutexLock lock(&mutex_);
    ++num_hanging_;
    mutex_.Await(absl::Condition(&goes_on));
    --num_hanging_;
    return blobs_;
  }

  store::BlobStore& blobs_;
  std::atomic<int> num_opened_ = 0;
  absl::Mutex mutex_;
  bool hangs_ ABSL_GUARDED_BY(mutex_) = false;
  int num_hanging_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace liquidblend::server
