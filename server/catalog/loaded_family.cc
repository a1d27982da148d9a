#include "server/catalog/loaded_family.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/files/files.h"

namespace liquidblend::catalog {
namespace {

// The same status with the family's name in front. A blob or file that the catalog refers to and
// that is not there, or is no family file, is lost data.
absl::Status LoadError(const std::string& id, const absl::Status& status) {
  if (status.ok()) return status;
  const bool is_loss = absl::IsNotFound(status) || absl::IsInvalidArgument(status);
  return absl::Status(is_loss ? absl::StatusCode::kDataLoss : status.code(),
                      absl::StrCat("family ", id, ": ", std::string(status.message())));
}

}  // namespace

absl::Status LoadedFamily::CheckFile() const {
  return file == nullptr ? absl::OkStatus() : LoadError(family.name, file->Check());
}

std::string GenerationOf(const store::pb::FamilyRecord& record) {
  return absl::StrCat(record.id(), "/", record.version(), "/", record.blob());
}

// Opening reads and checks every byte and every element, so what comes out is warm: frames of it
// are made at full speed from the first one on.
absl::StatusOr<FamilyPtr> LoadFamily(const store::pb::FamilyRecord& record,
                                     store::BlobStore& blobs) {
  absl::StatusOr<std::shared_ptr<const store::Blob>> blob = blobs.Open(record.blob());
  if (!blob.ok()) return LoadError(record.id(), blob.status());
  absl::StatusOr<mesh::RegisteredFamily> family = store::OpenFamily(*blob, record.id());
  if (!family.ok()) return LoadError(record.id(), family.status());
  family->name = record.id();
  family->version = record.version();
  auto space = frames::MakeOptionalSpace(family->parameter_space);
  if (!space.ok()) return LoadError(record.id(), space.status());
  const auto loaded = std::make_shared<LoadedFamily>(*std::move(family), *std::move(space));
  loaded->generation = GenerationOf(record);
  loaded->file = *blob;
  LB_RETURN_IF_ERROR(loaded->CheckFile());
  loaded->size_bytes = static_cast<int64_t>((*blob)->bytes().size()) + loaded->index_bytes();
  return FamilyPtr(loaded);
}

}  // namespace liquidblend::catalog
