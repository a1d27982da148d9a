// Stored files of animations and families for clients: their urls, and parts through the server.
#include <algorithm>
#include <cstddef>
#include <span>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "core/store/catalog/job_records.h"
#include "server/api/handlers.h"
#include "server/base/errors.h"
#include "server/base/names.h"
#include "server/frames/family_version.h"

namespace liquidblend::server {
namespace {

constexpr int64_t kPartBytes = int64_t{1} << 20;

struct StoredFile {
  store::BlobId blob;
  int64_t size_bytes = 0;
  int64_t version = 0;  // of a family
};

// An id alone stands for the animation or the family that has it.
absl::StatusOr<std::string> WithCollection(store::Catalog& catalog, const std::string& name) {
  if (absl::StrContains(name, '/')) return name;
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("name", name));
  const absl::Status family = catalog.GetFamily(id).status();
  if (absl::IsNotFound(family)) return AnimationName(id);
  LB_RETURN_IF_ERROR(family);
  const absl::Status animation = catalog.GetAnimation(id).status();
  if (absl::IsNotFound(animation)) return FamilyName(id);
  LB_RETURN_IF_ERROR(animation);
  return InvalidField("name", absl::StrCat("'", id, "' is an animation and a family: say ",
                                           AnimationName(id), " or ", FamilyName(id)));
}

absl::StatusOr<StoredFile> FamilyFile(store::Catalog& catalog, const std::string& name,
                                      int64_t version) {
  LB_ASSIGN_OR_RETURN(const std::string id, FamilyId("name", name));
  LB_ASSIGN_OR_RETURN(const store::pb::FamilyRecord family,
                      FindFamilyVersion(catalog, id, version));
  return StoredFile{family.blob(), family.size_bytes(), family.version()};
}

absl::StatusOr<StoredFile> AnimationFile(store::Catalog& catalog, const std::string& name,
                                         int64_t version) {
  LB_ASSIGN_OR_RETURN(const std::string id, AnimationId("name", name));
  if (version != 0) return InvalidField("version", "an animation has none");
  LB_ASSIGN_OR_RETURN(const store::pb::AnimationRecord animation, catalog.GetAnimation(id));
  if (animation.state() != store::pb::AnimationRecord::READY) return StoredFile();
  return StoredFile{animation.blob(), animation.size_bytes(), 0};
}

// Errors: kFailedPrecondition if there is no file yet.
absl::StatusOr<StoredFile> FindStoredFile(store::Catalog& catalog, const std::string& name,
                                          int64_t version) {
  LB_ASSIGN_OR_RETURN(const std::string full, WithCollection(catalog, name));
  const bool is_family = absl::StartsWith(full, "families/");
  LB_ASSIGN_OR_RETURN(StoredFile file, is_family ? FamilyFile(catalog, full, version)
                                                 : AnimationFile(catalog, full, version));
  if (!file.blob.empty()) return file;
  return absl::FailedPreconditionError(absl::StrCat(full, " has no file yet"));
}

}  // namespace

absl::StatusOr<v1::PresignDownloadResponse> PresignDownload(
    Backends& backends, const v1::PresignDownloadRequest& request) {
  LB_ASSIGN_OR_RETURN(const StoredFile file,
                      FindStoredFile(backends.catalog, request.name(), request.version()));
  v1::PresignDownloadResponse response;
  *response.mutable_expire_time() = store::ToTimestamp(absl::Now() + kUrlsLast);
  LB_ASSIGN_OR_RETURN(*response.mutable_url(),
                      backends.blobs.PresignDownload(file.blob, kUrlsLast));
  response.set_size_bytes(file.size_bytes);
  response.set_checksum(file.blob);
  response.set_version(file.version);
  return response;
}

absl::StatusOr<v1::ReadFileResponse> ReadFile(Backends& backends,
                                              const v1::ReadFileRequest& request) {
  if (request.offset() < 0) {
    return InvalidField("offset", absl::StrCat("must be >= 0, got ", request.offset()));
  }
  LB_ASSIGN_OR_RETURN(const StoredFile file,
                      FindStoredFile(backends.catalog, request.name(), request.version()));
  if (!request.checksum().empty() && request.checksum() != file.blob) {
    return absl::AbortedError(absl::StrCat("the file of ", request.name(), " is now ", file.blob,
                                           ", no longer ", request.checksum(), ": begin again"));
  }
  LB_ASSIGN_OR_RETURN(const BlobPtr blob, backends.open_blobs.Open(file.blob, request.name()));
  const std::span<const std::byte> bytes = blob->bytes();
  const auto size = static_cast<int64_t>(bytes.size());
  if (request.offset() > size) {
    return InvalidField("offset", absl::StrCat("must be at most the file's size, ", size, ", got ",
                                               request.offset()));
  }
  const auto part =
      bytes.subspan(static_cast<size_t>(request.offset()),
                    static_cast<size_t>(std::min(kPartBytes, size - request.offset())));
  v1::ReadFileResponse response;
  response.set_data(part.data(), part.size());
  LB_RETURN_IF_ERROR(blob->Check());
  response.set_size_bytes(size);
  response.set_checksum(file.blob);
  response.set_version(file.version);
  return response;
}

}  // namespace liquidblend::server
