// Deletion of the uploaded files of an import.
#pragma once

#include "core/store/blobs/blob_store.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::store {

// Deletes the files that came through the server for this import alone. For an import that has
// failed for good or was cancelled before it began: its files do not count for an owner any more.
// Files that cannot be deleted now are collected later, and a warning is logged. Does nothing
// without files.
// Threads: safe.
void DeleteUploadedFiles(const v1::ImportJob& job, BlobStore& blobs);

}  // namespace liquidblend::store
