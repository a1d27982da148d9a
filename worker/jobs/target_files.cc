#include "worker/jobs/target_files.h"

#include <memory>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/content_hash.h"
#include "core/store/files/files.h"

namespace liquidblend::jobs {
namespace {

// With its size: what follows another array is not part of it.
template <typename Element>
void Add(std::span<const Element> elements, store::BlobHasher& hasher) {
  const uint64_t size = elements.size();
  hasher.Add(std::as_bytes(std::span(&size, 1)));
  hasher.Add(std::as_bytes(elements));
}

// Errors: kDataLoss if a part of the file could not be read since it was opened.
absl::Status CheckReadable(const store::Blob& blob, const std::string& name) {
  const absl::Status readable = blob.Check();
  if (readable.ok()) return readable;
  return absl::Status(readable.code(), absl::StrCat(name, ": ", readable.message()));
}

}  // namespace

std::string HashOf(const mesh::SpaceTimeMesh& mesh) {
  const mesh::RegisteredFamily view = mesh::ViewOf(mesh);
  store::BlobHasher hasher(store::HashKind::kXxh3_128);
  Add(view.vertices, hasher);
  Add(view.velocities, hasher);
  Add(view.tetrahedra, hasher);
  Add(view.pyramids, hasher);
  Add(view.wedges, hasher);
  Add(view.hexahedra, hasher);
  return hasher.Id();
}

absl::StatusOr<store::BlobId> StoreTarget(const RegisteredTarget& target,
                                          const std::string& source_mesh, store::BlobStore& blobs) {
  store::TargetFile file;
  file.target = ViewOf(target);
  file.space_time = target.space_time;
  file.source_mesh = source_mesh;
  LB_ASSIGN_OR_RETURN(const std::unique_ptr<store::BlobWriter> out, blobs.Create());
  LB_RETURN_IF_ERROR(store::WriteTarget(file, *out));
  return out->Commit();
}

absl::StatusOr<std::optional<RegisteredTarget>> ReadTarget(const store::BlobId& id,
                                                           const std::string& target,
                                                           const std::string& source_mesh,
                                                           store::BlobStore& blobs) {
  const std::string name = absl::StrCat("target '", target, "'");
  const absl::StatusOr<std::shared_ptr<const store::Blob>> blob = blobs.Open(id);
  if (!blob.ok()) {
    return absl::Status(blob.status().code(), absl::StrCat(name, ": ", blob.status().message()));
  }
  const absl::StatusOr<store::TargetFile> opened = store::OpenTarget(*blob, name);
  LB_RETURN_IF_ERROR(CheckReadable(**blob, name));  // first: zeros look like a bad file
  LB_RETURN_IF_ERROR(opened.status());
  const store::TargetFile& file = *opened;
  if (file.target.name != target) {
    return absl::FailedPreconditionError(
        absl::StrCat("the target file of ", name, " is one of target '", file.target.name, "'"));
  }
  if (!file.source_mesh.empty() && file.source_mesh != source_mesh) {
    return std::optional<RegisteredTarget>();
  }
  RegisteredTarget result;
  result.name = target;
  result.space_time = file.space_time;
  result.registration.displacement = MatrixOf(file.target.displacement);
  result.registration.extrapolation = MatrixOf(file.target.extrapolation);
  result.registration.report = file.target.report;
  LB_RETURN_IF_ERROR(CheckReadable(**blob, name));
  return std::optional<RegisteredTarget>(std::move(result));
}

}  // namespace liquidblend::jobs
