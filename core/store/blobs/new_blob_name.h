// The name of a blob that is being written.
#pragma once

#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// Name of a new blob: given, or made from its content.
struct NewBlobName {
  BlobId id;               // the bytes must match it; empty: made from their content ...
  bool is_upload = false;  // ... with digits that make it unique
};

}  // namespace liquidblend::store
