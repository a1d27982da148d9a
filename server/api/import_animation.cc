#include "server/api/import_animation.h"

#include <memory>
#include <optional>
#include <utility>

#include "core/base/status_macros.h"
#include "server/api/api_messages.h"
#include "server/api/upload.h"
#include "server/base/errors.h"
#include "server/base/guarded.h"

namespace liquidblend::server {
namespace {

using google::longrunning::Operation;
using ImportDone = absl::AnyInvocable<void(absl::StatusOr<Operation>)>;

class Import : public std::enable_shared_from_this<Import> {
 public:
  Import(Backends& backends, const ImportRoots& roots, v1::ImportAnimationRequest request,
         const Caller& caller, IsWanted is_wanted, ImportDone done)
      : backends_(backends),
        roots_(roots),
        request_(std::move(request)),
        limits_(LimitsOf(backends.limits, caller.principal)),
        is_wanted_(std::move(is_wanted)),
        done_(std::move(done)),
        upload_(std::make_shared<Upload>(
            UploadStores{backends.catalog, backends.blobs, backends.uploads}, limits_, caller,
            /*header_field=*/"")) {}

  // Deleting the files of an import that broke off waits for the store.
  ~Import() {
    RunGuarded("the end of an upload", [this] {
      backends_.transfers.PostMore([upload = std::move(upload_)]() mutable { upload = nullptr; });
    });
  }

  void PostStep() {
    const absl::Status posted = Guarded([&]() -> absl::Status {
      const bool is_posted =
          backends_.transfers.PostMore([self = shared_from_this()] { self->Step(); });
      return is_posted ? absl::OkStatus() : ShuttingDown();
    });
    if (!posted.ok()) Finish(posted);
  }

 private:
  void Step() {
    if (!is_wanted_()) return Finish(absl::CancelledError("the client has gone"));
    const absl::StatusOr<bool> has_more = Guarded([this] { return Copy(); });
    if (!has_more.ok()) return Finish(has_more.status());
    if (*has_more) return PostStep();
    Finish(Guarded([this]() -> absl::StatusOr<Operation> {
      LB_ASSIGN_OR_RETURN(const store::pb::JobRecord job, upload_->Submit());
      return ToOperation(job, backends_.catalog);
    }));
  }

  void Finish(absl::StatusOr<Operation> operation) {
    ImportDone done = std::exchange(done_, nullptr);
    done(std::move(operation));
  }

  // The header first, then message by message what the source has; false: nothing more.
  absl::StatusOr<bool> Copy() {
    v1::UploadAnimationRequest message;
    if (!source_.has_value()) {
      LB_RETURN_IF_ERROR(Open());
      return true;
    }
    LB_ASSIGN_OR_RETURN(const bool has_more, source_->Next(message));
    if (!has_more) return false;
    const absl::Status added = upload_->Add(message);
    // A wrong file is a violation of the location.
    if (absl::IsInvalidArgument(added)) return AtField("location", added);
    LB_RETURN_IF_ERROR(added);
    return true;
  }

  absl::Status Open() {
    v1::UploadAnimationRequest message;
    message.mutable_header()->set_animation_id(request_.animation_id());
    *message.mutable_header()->mutable_options() = request_.options();
    message.mutable_header()->set_request_id(request_.request_id());
    message.mutable_header()->set_priority(request_.priority());
    LB_RETURN_IF_ERROR(upload_->Add(message));
    absl::StatusOr<ImportSource> source = ImportSource::Open(
        roots_, request_.location(), limits_.max_upload_files, request_.options().pattern());
    LB_RETURN_IF_ERROR(source.status());
    source_.emplace(*std::move(source));
    return absl::OkStatus();
  }

  Backends& backends_;
  const ImportRoots& roots_;
  const v1::ImportAnimationRequest request_;
  const Limits limits_;
  const IsWanted is_wanted_;
  ImportDone done_;
  std::shared_ptr<Upload> upload_;
  std::optional<ImportSource> source_;
};

}  // namespace

void ImportAnimation(Backends& backends, const ImportRoots& roots,
                     v1::ImportAnimationRequest request, const Caller& caller, IsWanted is_wanted,
                     ImportDone done) {
  std::make_shared<Import>(backends, roots, std::move(request), caller, std::move(is_wanted),
                           std::move(done))
      ->PostStep();
}

}  // namespace liquidblend::server
