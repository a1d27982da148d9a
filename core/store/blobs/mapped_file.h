// Files mapped into memory that survive pages which cannot be read.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/posix_file.h"
#include "core/store/blobs/blob_store.h"

namespace liquidblend::store {

// Installs a handler of SIGBUS, once per process. A page of a mapped file that cannot be read (a
// failing disk, a file that was cut short) would kill the process when it is touched; with the
// handler it reads as zeros from then on, and Blob::Check() of that file fails. Faults elsewhere
// end the process as before.  Threads: call it before others map files.
void SurviveUnreadablePages();

// Maps the first `size` bytes of the file, read only; the file may be closed afterwards.
// Errors: those of the system, with the path.
absl::StatusOr<std::shared_ptr<const Blob>> MapFile(const base::FileHandle& file, size_t size,
                                                    const std::string& path);

}  // namespace liquidblend::store
