// Checkpoint file: a registration's state, for a worker that resumes it (docs/formats.md,
// "Checkpoint file").
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/store/blobs/blob_store.h"
#include "worker/registration/fit/state.h"

namespace liquidblend::jobs {

struct CheckpointLabel {
  std::string fingerprint;  // of all input of the registration
  std::string lease;        // of the writer; with the number, it makes files unique
  int64_t number = 0;
};

struct Checkpoint {
  CheckpointLabel label;
  registration::RegistrationState state;
};

// Errors: the writer's.
absl::Status WriteCheckpoint(const CheckpointLabel& label,
                             const registration::RegistrationState& state, store::BlobWriter& out);

//   name  how messages call the file
// Errors: kDataLoss if the file is damaged, naming the section; kInvalidArgument if it is not a
// checkpoint file, has an unknown format version, or contradicts itself.
absl::StatusOr<Checkpoint> ReadCheckpoint(const store::Blob& blob, const std::string& name);

}  // namespace liquidblend::jobs
