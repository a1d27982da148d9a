#include "server/api/archive_upload.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/api/upload.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/tar/tar_splitter.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;

// Files of an archive as the messages of an upload.
class UploadSink final : public tar::FileSink {
 public:
  UploadSink(Upload& upload, int64_t max_chunk_bytes)
      : upload_(upload), max_chunk_bytes_(static_cast<size_t>(max_chunk_bytes)) {}

  absl::Status BeginFile(const tar::TarEntry& file) override {
    message_.mutable_file()->set_name(file.name);
    message_.mutable_file()->set_size_bytes(file.size_bytes);
    return Add();
  }

  absl::Status AddBytes(std::span<const std::byte> bytes) override {
    while (!bytes.empty()) {
      const auto chunk = bytes.first(std::min(bytes.size(), max_chunk_bytes_));
      message_.set_chunk(chunk.data(), chunk.size());
      LB_RETURN_IF_ERROR(Add());
      bytes = bytes.subspan(chunk.size());
    }
    return absl::OkStatus();
  }

  // Error of the upload; the archive itself may be whole.
  const absl::Status& error() const { return error_; }

 private:
  absl::Status Add() { return error_ = upload_.Add(message_); }

  Upload& upload_;
  const size_t max_chunk_bytes_;
  v1::UploadAnimationRequest message_;
  absl::Status error_;
};

class PooledUpload final : public ArchiveUpload, public std::enable_shared_from_this<PooledUpload> {
 public:
  PooledUpload(Backends& backends, v1::UploadAnimationRequest header, const Caller& caller)
      : backends_(backends),
        header_(std::move(header)),
        upload_(std::make_shared<Upload>(
            UploadStores{backends.catalog, backends.blobs, backends.uploads},
            LimitsOf(backends.limits, caller.principal), caller)),
        sink_(*upload_, backends.limits.max_chunk_bytes) {}

  // Deleting the files of an upload that broke off waits for the store.
  ~PooledUpload() override {
    RunGuarded("the end of an upload", [this] {
      backends_.transfers.PostMore([upload = std::move(upload_)]() mutable { upload = nullptr; });
    });
  }

  void Add(std::string piece, absl::AnyInvocable<void(absl::Status)> done) override {
    Post([this, piece = std::move(piece)] { return Take(piece); }, std::move(done));
  }

  void Submit(absl::AnyInvocable<void(absl::StatusOr<Operation>)> done) override {
    Post(
        [this]() -> absl::StatusOr<Operation> {
          LB_RETURN_IF_ERROR(Take(""));
          LB_RETURN_IF_ERROR(OfArchive(splitter_.End()));
          LB_ASSIGN_OR_RETURN(const store::pb::JobRecord job, upload_->Submit());
          return ToOperation(job, backends_.catalog);
        },
        std::move(done));
  }

 private:
  // done(work()) on the pool.
  template <typename Work, typename Done>
  void Post(Work work, Done done) {
    const auto call = std::make_shared<std::pair<Work, Done>>(std::move(work), std::move(done));
    const bool is_posted = backends_.transfers.PostMore(
        [self = shared_from_this(), call] { call->second(Guarded(call->first)); });
    if (!is_posted) call->second(ShuttingDown());
  }

  absl::Status Take(const std::string& piece) {
    if (!has_begun_) {
      has_begun_ = true;
      LB_RETURN_IF_ERROR(upload_->Add(header_));
    }
    const absl::Status added = splitter_.Add(std::as_bytes(std::span(piece)), sink_);
    return sink_.error().ok() ? OfArchive(added) : added;
  }

  static absl::Status OfArchive(const absl::Status& status) {
    return status.ok() ? status : WithReason(status, "ARCHIVE_MALFORMED");
  }

  Backends& backends_;
  const v1::UploadAnimationRequest header_;
  std::shared_ptr<Upload> upload_;
  UploadSink sink_;
  tar::TarSplitter splitter_;
  bool has_begun_ = false;
};

}  // namespace

std::shared_ptr<ArchiveUpload> OpenArchiveUpload(Backends& backends,
                                                 v1::UploadAnimationRequest header,
                                                 const Caller& caller) {
  return std::make_shared<PooledUpload>(backends, std::move(header), caller);
}

}  // namespace liquidblend::server
