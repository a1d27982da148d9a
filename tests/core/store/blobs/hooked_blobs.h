// A blob store in front of another one, for tests that have to be in between.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/synchronization/mutex.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// A blob store that does something each time that a blob is opened or begun.
class HookedBlobs : public BlobStore {
 public:
  explicit HookedBlobs(std::unique_ptr<BlobStore> blobs) : blobs_(std::move(blobs)) {}
  absl::StatusOr<std::unique_ptr<BlobWriter>> Create() override {
    if (on_create) {
      if (absl::Status status = on_create(); !status.ok()) return status;
    }
    return blobs_->Create();
  }
  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateAs(const BlobId& id) override {
    return blobs_->CreateAs(id);
  }
  absl::StatusOr<std::unique_ptr<BlobWriter>> CreateUpload() override {
    return blobs_->CreateUpload();
  }
  absl::StatusOr<std::shared_ptr<const Blob>> Open(const BlobId& id) override {
    if (on_open) {
      const absl::MutexLock lock(&mutex_);
      if (absl::Status status = on_open(); !status.ok()) return status;
    }
    auto blob = blobs_->Open(id);
    if (after_open) after_open(id);
    return blob;
  }
  absl::Status Verify(const BlobId& id) override { return blobs_->Verify(id); }
  absl::Status Delete(const BlobId& id) override { return blobs_->Delete(id); }
  absl::StatusOr<bool> DeleteIfNotNewer(const BlobId& id, absl::Time time) override {
    return blobs_->DeleteIfNotNewer(id, time);
  }
  absl::StatusOr<std::string> Quarantine(const BlobId& id) override {
    return blobs_->Quarantine(id);
  }
  absl::StatusOr<std::vector<BlobInfo>> List() override { return blobs_->List(); }
  absl::StatusOr<std::string> ReadCatalogId() override { return blobs_->ReadCatalogId(); }
  absl::Status WriteCatalogId(const std::string& id) override { return blobs_->WriteCatalogId(id); }

  std::function<absl::Status()> on_open, on_create;  // on_open: one call at a time
  std::function<void(const BlobId&)> after_open;

 private:
  absl::Mutex mutex_;
  std::unique_ptr<BlobStore> blobs_;
};

}  // namespace liquidblend::store
