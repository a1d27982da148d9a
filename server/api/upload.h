// Upload of the files of one animation: checks the client's messages and streams them into blobs.
// Knows no gRPC.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/catalog/catalog.h"
#include "liquidblend/v1/liquidblend.pb.h"
#include "server/access/principal.h"
#include "server/access/upload_tally.h"
#include "server/frames/backends.h"

namespace liquidblend::server {

// The server's limits, combined with those of the principal.
Limits LimitsOf(const Limits& limits, const Principal& principal);

// kResourceExhausted (UPLOAD_TOO_LARGE); `file`: the file that exceeds the limit, or empty.
absl::Status UploadTooLarge(const Limits& limits, const std::string& file);

// Early check, to spare clients a useless upload; Catalog::SubmitImport() decides.  Errors:
// kAlreadyExists.
absl::Status CheckIsFree(store::Catalog& catalog, const std::string& animation_id);

// Stores of uploads, which all outlive them.
struct UploadStores {
  store::Catalog& catalog;
  store::BlobStore& blobs;
  UploadTally& tally;
};

// Nothing is visible before Submit(). The destructor deletes the files of an upload that was not
// accepted, which may wait for the store; files that a client has sent directly, and files that
// cannot be deleted within some seconds, stay until they are collected.  Threads: one at a time.
class Upload {
 public:
  // header_field: name of the header in the caller's request, for violations.
  Upload(const UploadStores& stores, const Limits& limits, const Caller& caller = {},
         std::string header_field = "header.");
  ~Upload();
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  // Takes the next message: the header first, then each file followed by its chunks.
  // Errors: kInvalidArgument with the field at fault, kResourceExhausted (limits, disk full),
  // kAlreadyExists (early, unless the header has a request_id). The limits of its owner and of all
  // owners, and the disk's space, are checked when the upload begins, at each file and when it is
  // submitted.
  absl::Status Add(const v1::UploadAnimationRequest& message);

  // Whether the header says how many files follow.
  bool knows_num_files() const { return num_files_ > 0; }

  // To be called after the last message. Errors: kInvalidArgument if a file is incomplete, there is
  // none, or their number is not the header's; those of Catalog::SubmitImport.
  absl::StatusOr<store::pb::JobRecord> Submit();

 private:
  absl::Status CheckOptions(const v1::ImportOptions& options) const;
  absl::Status AddHeader(const v1::UploadAnimationRequest::Header& header);
  absl::Status AddFile(const v1::UploadAnimationRequest::File& file);
  absl::Status AddChunk(const std::string& chunk);
  absl::Status CheckFile(const v1::UploadAnimationRequest::File& file) const;
  absl::Status CheckOwner();
  absl::Status CheckSpace(int64_t new_bytes);
  absl::Status CheckFileIsComplete() const;
  absl::Status CommitFileIfComplete();
  absl::Status AddSentFile(const v1::UploadAnimationRequest::File& file);
  absl::Status CheckNumFiles() const;
  absl::Status Reserve(const v1::UploadAnimationRequest::File& file);
  void OnAccepted(const store::pb::JobRecord& job);
  void DeleteFiles();

  const UploadStores stores_;
  const Limits limits_;
  const Principal principal_;
  const std::string header_field_;
  store::pb::JobRecord job_;            // grows with each complete file
  std::optional<store::OwnerUse> use_;  // what the owner had at the beginning, if it is limited
  int64_t stored_bytes_ = 0;            // of all owners, at the beginning, if that is limited
  std::set<std::string> file_names_;
  int num_files_ = 0;                          // of the header; 0: not given
  std::vector<store::BlobId> to_delete_;       // stored, not accepted yet
  int64_t declared_bytes_ = 0;                 // of all files so far
  int64_t reserved_bytes_ = 0;                 // of them, in the tally and not promised
  int64_t unwritten_bytes_ = 0;                // of them, in the tally and not on the disk yet
  store::pb::SourceFile file_;                 // the one that chunks go to
  int64_t received_bytes_ = 0;                 // of that file
  std::unique_ptr<store::BlobWriter> writer_;  // of that file, while it is not complete
};

}  // namespace liquidblend::server
