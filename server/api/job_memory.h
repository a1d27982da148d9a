// How much memory a job will need, guessed before it begins from what it is about. The figures come
// from docs/experiments (registration-speed.md, large-animations.md, space-time-meshes.md,
// sanitizers-and-fuzzing.md), rounded up; they are guesses, and most jobs need less.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::server {

// Bytes; of the files of an import.
int64_t MemoryToImport(const store::v1::ImportJob& job);

// Bytes; of the largest of a registration's parts, which all get the same estimate. It follows from
// the animations' vertices, frames, times and bounds, and from the job's spacing, number of targets
// and levels of detail.
int64_t MemoryToRegister(const store::v1::RegisterJob& job,
                         const store::v1::AnimationRecord& source,
                         const std::vector<store::v1::AnimationRecord>& targets);

// Notes in the job what it needs. Errors: kResourceExhausted (JOB_TOO_LARGE, with the estimate and
// the limit) if that is more than worker_memory_bytes, what the server's workers can hold (0: not
// known), and than any other worker has told of lately. Those of the catalog, if it cannot be asked
// for the animations; one that is missing is told of when the job is submitted.
absl::Status NoteMemory(store::Catalog& catalog, int64_t worker_memory_bytes,
                        store::v1::JobRecord& job);

// Why a queued job stays where it is: it needs more than any worker that asked lately can hold, or
// none has asked, or all that can hold it are refused by S3, the database or their disk and take no
// jobs; empty if one can take it.
//   workers  Catalog::ListWorkers()
std::string WaitsFor(const store::v1::JobRecord& job,
                     const std::vector<store::v1::WorkerRecord>& workers);

}  // namespace liquidblend::server
