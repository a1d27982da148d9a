#include "core/store/blobs/upload_files.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/log.h"

namespace liquidblend::store {

void DeleteUploadedFiles(const v1::ImportJob& job, BlobStore& blobs) {
  for (const v1::SourceFile& file : job.files()) {
    if (file.sent_directly() || !IsUploadId(file.blob())) continue;
    const absl::Status deleted = blobs.Delete(file.blob());
    if (deleted.ok()) continue;
    return base::LogWarning(absl::StrCat(
        "cannot delete the files of an import, they will be collected: ", deleted.ToString()));
  }
}

}  // namespace liquidblend::store
