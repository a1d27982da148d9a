// The files that an import reads.
#pragma once

#include "core/store/blobs/blob_store.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::store {

// Deletes the files that came through the server for this import alone. For an import that has
// failed for good or was cancelled before it began: its files count for no owner any more. What
// the store does not delete now is collected, and a warning is logged. Nothing without files.
// Threads: safe.
void DeleteUploadedFiles(const v1::ImportJob& job, BlobStore& blobs);

}  // namespace liquidblend::store
