// Estimates of the memory that a job will need, made from its input before it begins. The figures
// come from docs/experiments (registration-speed.md, large-animations.md, space-time-meshes.md,
// sanitizers-and-fuzzing.md), rounded up; most jobs need less.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/catalog/catalog.h"
#include "liquidblend/store/v1/records.pb.h"

namespace liquidblend::server {

// Bytes for an import of these files.
int64_t MemoryToImport(const store::v1::ImportJob& job);

// Bytes for the largest of a registration's children, which all get the same estimate. It follows
// from the animations' vertices, frames, times and bounds, and from the job's spacing, number of
// targets and levels of detail.
int64_t MemoryToRegister(const store::v1::RegisterJob& job,
                         const store::v1::AnimationRecord& source,
                         const std::vector<store::v1::AnimationRecord>& targets);

// Sets the estimate in the job. Errors: kResourceExhausted (JOB_TOO_LARGE, with the estimate and
// the limit) if it exceeds both worker_memory_bytes, the memory of the server's workers (0: not
// known), and the memory of every other recorded worker; those of the catalog. A missing animation
// is not an error here; submitting the job refuses it.
absl::Status NoteMemory(store::Catalog& catalog, int64_t worker_memory_bytes,
                        store::v1::JobRecord& job);

// Why a queued job waits: it needs more memory than any recorded worker has, no worker is recorded,
// or all workers with enough memory are refused by S3, the database or their disk. Empty if a
// worker can take it.
//   workers  Catalog::ListWorkers()
std::string WaitsFor(const store::v1::JobRecord& job,
                     const std::vector<store::v1::WorkerRecord>& workers);

}  // namespace liquidblend::server
