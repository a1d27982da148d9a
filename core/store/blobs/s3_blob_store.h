// Blobs in S3.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"
#include "core/store/blobs/s3_options.h"

namespace liquidblend::store {

// Opens a store of blobs in an S3 bucket: objects s3://bucket/prefix/blobs/<2 digits>/<id>, sent
// when they are committed. Written and opened blobs are in a local cache, too: they are fetched
// once, verified each time they are opened, and served from there while S3 cannot be reached or
// refuses access.
// The bucket must exist; while this cannot be checked, the store is opened with a warning in the
// log. Errors, beside those of BlobStore: kInvalidArgument for a url that is not
// s3://bucket/prefix, options out of range, or missing credentials; kNotFound for the bucket; those
// of the cache directory. Messages name bucket and key.
absl::StatusOr<std::unique_ptr<BlobStore>> OpenS3BlobStore(const std::string& url,
                                                           const S3Options& options);

}  // namespace liquidblend::store
