#include "server/api/upload.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"
#include "core/base/steady_cond_var.h"
#include "core/mesh/option_ranges.h"
#include "server/access/owner_limits.h"
#include "server/api/api_messages.h"
#include "server/api/job_memory.h"
#include "server/api/store_space.h"
#include "server/api/submission.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"
#include "server/base/names.h"
#include "server/base/request_id.h"

namespace liquidblend::server {
namespace {

constexpr size_t kMaxPatternBytes = 255;  // as a file name
constexpr size_t kMaxFileNameLength = 255;

// How long deleting the files of an upload may take; the collector deletes the rest.
constexpr absl::Duration kDeletePatience = absl::Seconds(5);

// Whether the catalog has certainly not accepted the job.
bool IsRefusal(const absl::Status& error) {
  return absl::IsInvalidArgument(error) || absl::IsAlreadyExists(error) ||
         absl::IsFailedPrecondition(error) || absl::IsNotFound(error) ||
         error.GetPayload(kErrorInfoUrl).has_value();
}

// A base name that is safe to show and to write.
bool IsBaseName(absl::string_view name) {
  if (name.empty() || name.size() > kMaxFileNameLength || name == "." || name == "..") return false;
  for (const char c : name) {
    if (c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20) return false;
  }
  return true;
}

}  // namespace

Limits LimitsOf(const Limits& limits, const Principal& principal) {
  Limits both = limits;
  const int64_t own = principal.limits.max_upload_bytes;
  if (own > 0) both.max_upload_bytes = std::min(both.max_upload_bytes, own);
  return both;
}

absl::Status UploadTooLarge(const Limits& limits, const std::string& file) {
  return WithReason(absl::ResourceExhaustedError(
                        absl::StrCat("more than ", limits.max_upload_bytes, " bytes in one upload",
                                     file.empty() ? "" : absl::StrCat(", with '", file, "'"))),
                    "UPLOAD_TOO_LARGE", {{"limit", absl::StrCat(limits.max_upload_bytes)}});
}

absl::Status CheckIsFree(store::Catalog& catalog, const std::string& animation_id) {
  absl::StatusOr<store::pb::AnimationRecord> there = catalog.GetAnimation(animation_id);
  if (absl::IsNotFound(there.status())) return absl::OkStatus();
  LB_RETURN_IF_ERROR(there.status());
  if (there->state() == store::pb::AnimationRecord::FAILED) return absl::OkStatus();
  return absl::AlreadyExistsError(absl::StrCat(
      AnimationName(animation_id), " exists already; choose another name, or delete it first"));
}

Upload::Upload(const UploadStores& stores, const Limits& limits, const Caller& caller,
               std::string header_field)
    : stores_(stores),
      limits_(limits),
      principal_(caller.principal),
      header_field_(std::move(header_field)) {
  SetCaller(caller, job_);
}

Upload::~Upload() {
  RunGuarded("the end of an upload", [this] { DeleteFiles(); });
  stores_.tally.Add(principal_.name, -reserved_bytes_);
  stores_.tally.AddUnwritten(-unwritten_bytes_);
}

absl::Status Upload::Add(const v1::UploadAnimationRequest& message) {
  const bool is_first = !job_.has_import_animation();
  if (is_first != message.has_header()) {
    return InvalidField("header",
                        is_first ? "must be the first message" : "must not be sent again");
  }
  switch (message.payload_case()) {
    case v1::UploadAnimationRequest::kHeader:
      return AddHeader(message.header());
    case v1::UploadAnimationRequest::kFile:
      return AddFile(message.file());
    case v1::UploadAnimationRequest::kChunk:
      return AddChunk(message.chunk());
    case v1::UploadAnimationRequest::PAYLOAD_NOT_SET:
      break;
  }
  return InvalidField("payload", "is missing");
}

absl::Status Upload::CheckOptions(const v1::ImportOptions& options) const {
  const std::string prefix = absl::StrCat(header_field_, "options.");
  FieldViolations violations;
  violations.AddIf(!v1::AnimationFormat_IsValid(options.format()), absl::StrCat(prefix, "format"),
                   absl::StrCat("unknown format ", options.format()));
  violations.AddIf(!v1::Up_IsValid(options.up()), absl::StrCat(prefix, "up"),
                   absl::StrCat("unknown direction ", options.up()));
  const auto check = [&](absl::string_view field, double value) {
    violations.AddIf(!(value >= 0) || !std::isfinite(value), absl::StrCat(prefix, field),
                     absl::StrCat("must be 0 (not given) or greater, got ", value));
  };
  const double fps = options.frames_per_second();
  violations.AddIf(fps != 0 && !mesh::kFramesPerSecond.Holds(fps),
                   absl::StrCat(prefix, "frames_per_second"),
                   absl::StrCat("must be 0 (not given) or in [", mesh::kFramesPerSecond.min, ", ",
                                mesh::kFramesPerSecond.max, "], got ", fps));
  check("vertex_scale", options.vertex_scale());
  check("velocity_scale", options.velocity_scale());
  check("voxel_size_m", options.voxel_size_m());
  violations.AddIf(options.frame_times_size() > limits_.max_upload_files,
                   absl::StrCat(prefix, "frame_times"),
                   absl::StrCat("at most ", limits_.max_upload_files, " numbers, got ",
                                options.frame_times_size()));
  for (int k = 0; k < options.frame_times_size(); ++k) {
    check("frame_times", options.frame_times(k));
  }
  violations.AddIf(
      options.pattern().size() > kMaxPatternBytes, absl::StrCat(prefix, "pattern"),
      absl::StrCat("at most ", kMaxPatternBytes, " bytes, got ", options.pattern().size()));
  return violations.ToStatus();
}

absl::Status Upload::AddHeader(const v1::UploadAnimationRequest::Header& header) {
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId(absl::StrCat(header_field_, "animation_id"),
                                                        header.animation_id()));
  LB_RETURN_IF_ERROR(CheckOptions(header.options()));
  FieldViolations violations;
  CheckPriority(absl::StrCat(header_field_, "priority"), header.priority(), violations);
  LB_RETURN_IF_ERROR(violations.ToStatus());
  if (header.request_id().size() > kMaxRequestIdLength) {
    return InvalidField(absl::StrCat(header_field_, "request_id"),
                        absl::StrCat("at most ", kMaxRequestIdLength, " characters"));
  }
  if (header.request_id().empty()) LB_RETURN_IF_ERROR(CheckIsFree(stores_.catalog, id));
  if (header.num_files() < 0 || header.num_files() > limits_.max_upload_files) {
    return InvalidField(
        absl::StrCat(header_field_, "num_files"),
        absl::StrCat("must be in [0, ", limits_.max_upload_files, "], got ", header.num_files()));
  }
  num_files_ = header.num_files();
  job_.set_request_id(header.request_id());
  job_.set_priority(header.priority());
  job_.mutable_import_animation()->set_animation(id);
  *job_.mutable_import_animation()->mutable_options() = ToRecord(header.options());
  return CheckOwner();
}

// Only spares the client a useless upload, too. A request that was accepted before is not asked
// about.
absl::Status Upload::CheckOwner() {
  LB_ASSIGN_OR_RETURN(stored_bytes_, StoredBytes(stores_.catalog, limits_));
  LB_RETURN_IF_ERROR(CheckSpace(0));
  if (!OwnerCheckOf(principal_, 0)) return absl::OkStatus();
  return stores_.catalog.CheckOwner(job_, [this](const store::OwnerUse& use) {
    use_ = use;
    return CheckOwnerLimits(principal_, use, 0);
  });
}

// Room for all owners' uploads that are under way, and on the disk for new_bytes.
absl::Status Upload::CheckSpace(int64_t new_bytes) {
  absl::Status status = CheckDisk(stores_.blobs, limits_, new_bytes);
  if (status.ok() && limits_.max_stored_bytes > 0) {
    status = CheckStoredBytes(limits_, stored_bytes_, stores_.tally.Sum());
  }
  return UnlessAccepted(stores_.catalog, job_, status);
}

absl::Status Upload::AddFile(const v1::UploadAnimationRequest::File& file) {
  LB_RETURN_IF_ERROR(CheckFileIsComplete());
  LB_RETURN_IF_ERROR(CheckFile(file));
  LB_RETURN_IF_ERROR(Reserve(file));
  file_names_.insert(file.name());
  received_bytes_ = 0;
  file_.set_name(file.name());
  file_.set_size_bytes(file.size_bytes());
  file_.set_sent_directly(false);
  if (!file.blob().empty()) return AddSentFile(file);
  LB_ASSIGN_OR_RETURN(writer_, stores_.blobs.CreateUpload());
  return CommitFileIfComplete();
}

// Its content is compared with its checksum by the worker, who reads it.
absl::Status Upload::AddSentFile(const v1::UploadAnimationRequest::File& file) {
  if (!store::IsUploadId(file.blob())) return InvalidField("file.blob", "is not of PresignUpload");
  const absl::StatusOr<int64_t> size_bytes = stores_.blobs.SizeOfUpload(file.blob());
  if (absl::IsNotFound(size_bytes.status())) {
    return InvalidField("file.blob", absl::StrCat("'", file.name(), "' has not been sent"));
  }
  LB_RETURN_IF_ERROR(size_bytes.status());
  if (*size_bytes != file.size_bytes()) {
    return InvalidField("file.size_bytes",
                        absl::StrCat("of '", file.name(), "' ", *size_bytes,
                                     " bytes were sent, not ", file.size_bytes()));
  }
  received_bytes_ = file.size_bytes();
  file_.set_blob(file.blob());
  file_.set_sent_directly(true);
  *job_.mutable_import_animation()->add_files() = file_;
  return absl::OkStatus();
}

absl::Status Upload::CheckFile(const v1::UploadAnimationRequest::File& file) const {
  if (!IsBaseName(file.name())) {
    return InvalidField("file.name", "must be a base name of 1 to 255 characters");
  }
  if (file_names_.count(file.name()) > 0) {
    return InvalidField("file.name", absl::StrCat("'", file.name(), "' is sent twice"));
  }
  if (file.size_bytes() < 0) {
    return InvalidField("file.size_bytes", absl::StrCat("must be >= 0, got ", file.size_bytes(),
                                                        " for '", file.name(), "'"));
  }
  if (static_cast<int>(file_names_.size()) >= limits_.max_upload_files) {
    return WithReason(absl::ResourceExhaustedError(absl::StrCat(
                          "more than ", limits_.max_upload_files, " files in one upload")),
                      "TOO_MANY_FILES", {{"limit", absl::StrCat(limits_.max_upload_files)}});
  }
  if (file.size_bytes() > limits_.max_upload_bytes - declared_bytes_) {
    return UploadTooLarge(limits_, file.name());
  }
  return absl::OkStatus();
}

// Counts the file's bytes for its owner, whose other uploads may be under way. Those of a file that
// was promised count already, and go on doing so if this upload breaks off.
absl::Status Upload::Reserve(const v1::UploadAnimationRequest::File& file) {
  const bool is_promised =
      !file.blob().empty() && stores_.tally.HasPromise(principal_.name, file.blob());
  const int64_t new_bytes = is_promised ? 0 : file.size_bytes();
  const int64_t under_way = stores_.tally.Add(principal_.name, new_bytes);
  reserved_bytes_ += new_bytes;
  declared_bytes_ += file.size_bytes();
  if (use_.has_value()) LB_RETURN_IF_ERROR(CheckOwnerLimits(principal_, *use_, under_way));
  if (!file.blob().empty()) return CheckSpace(0);
  unwritten_bytes_ += file.size_bytes();
  return CheckSpace(stores_.tally.AddUnwritten(file.size_bytes()));
}

absl::Status Upload::AddChunk(const std::string& chunk) {
  if (writer_ == nullptr) {
    return InvalidField("chunk", file_.name().empty()
                                     ? "must follow a file"
                                     : absl::StrCat("'", file_.name(), "' has more than the ",
                                                    file_.size_bytes(), " bytes declared"));
  }
  const int64_t size = static_cast<int64_t>(chunk.size());
  if (size > limits_.max_chunk_bytes) {
    return InvalidField("chunk",
                        absl::StrCat("at most ", limits_.max_chunk_bytes, " bytes, got ", size));
  }
  if (size > file_.size_bytes() - received_bytes_) {
    return InvalidField("chunk", absl::StrCat("'", file_.name(), "' has more than the ",
                                              file_.size_bytes(), " bytes declared"));
  }
  LB_RETURN_IF_ERROR(writer_->Append(std::as_bytes(std::span(chunk))));
  received_bytes_ += size;
  unwritten_bytes_ -= size;
  stores_.tally.AddUnwritten(-size);
  return CommitFileIfComplete();
}

absl::Status Upload::CheckFileIsComplete() const {
  if (writer_ == nullptr) return absl::OkStatus();
  return InvalidField("file.size_bytes",
                      absl::StrCat("'", file_.name(), "' has ", received_bytes_, " of the ",
                                   file_.size_bytes(), " bytes declared"));
}

absl::Status Upload::CommitFileIfComplete() {
  if (received_bytes_ < file_.size_bytes()) return absl::OkStatus();
  LB_ASSIGN_OR_RETURN(*file_.mutable_blob(), writer_->Commit());
  to_delete_.push_back(file_.blob());
  writer_ = nullptr;
  *job_.mutable_import_animation()->add_files() = file_;
  return absl::OkStatus();
}

// A client that is lost may look like one that has sent everything.
absl::Status Upload::CheckNumFiles() const {
  const int num_files = job_.import_animation().files_size();
  if (num_files == 0) return InvalidField("file", "there must be at least one");
  if (num_files_ == 0 || num_files == num_files_) return absl::OkStatus();
  return InvalidField(absl::StrCat(header_field_, "num_files"),
                      absl::StrCat(num_files, " of ", num_files_, " files were sent"));
}

absl::StatusOr<store::pb::JobRecord> Upload::Submit() {
  if (!job_.has_import_animation()) return InvalidField("header", "must be the first message");
  LB_RETURN_IF_ERROR(CheckFileIsComplete());
  LB_RETURN_IF_ERROR(CheckNumFiles());
  LB_ASSIGN_OR_RETURN(stored_bytes_, StoredBytes(stores_.catalog, limits_));
  LB_RETURN_IF_ERROR(CheckSpace(0));
  store::pb::AnimationRecord animation;
  animation.set_id(job_.import_animation().animation());
  animation.set_state(store::pb::AnimationRecord::IMPORTING);
  LB_RETURN_IF_ERROR(NoteMemory(stores_.catalog, limits_.worker_memory_bytes, job_));
  // Only a refusal shows that nothing refers to the files; after other errors the job may be there.
  std::vector<store::BlobId> files = std::exchange(to_delete_, {});
  absl::StatusOr<store::pb::JobRecord> accepted =
      stores_.catalog.SubmitImport(animation, job_, OwnerCheckOf(principal_, declared_bytes_));
  if (accepted.ok() || IsRefusal(accepted.status())) to_delete_ = std::move(files);
  if (accepted.ok()) OnAccepted(*accepted);
  return accepted;
}

// From now on the catalog counts the files. A repeated request gets the job of the first one, which
// has files of its own.
void Upload::OnAccepted(const store::pb::JobRecord& job) {
  for (const store::pb::SourceFile& file : job.import_animation().files()) {
    std::erase(to_delete_, file.blob());
    stores_.tally.EndPromise(principal_.name, file.blob());
  }
  stores_.tally.Add(principal_.name, -std::exchange(reserved_bytes_, 0));
}

void Upload::DeleteFiles() {
  const base::SteadyClock::time_point begin = base::SteadyClock::now();
  for (const store::BlobId& blob : to_delete_) {
    if (base::Since(begin) > kDeletePatience) return;
    const absl::Status deleted = stores_.blobs.Delete(blob);
    if (deleted.ok()) continue;
    return base::LogWarning(absl::StrCat(
        "cannot delete the files of an upload, they will be collected: ", deleted.ToString()));
  }
}

}  // namespace liquidblend::server
