// Options and correspondences as jobs carry them -> as the stages take them.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "liquidblend/store/v1/records.pb.h"
#include "worker/ingest/read_animation.h"
#include "worker/registration/register.h"
#include "worker/registration/surface/correspondence.h"
#include "worker/spacetime/build.h"

namespace liquidblend::jobs {

ingest::ImportOptions ToImportOptions(const store::v1::ImportOptions& options);

// 0 stands for the stage's default.
registration::RegistrationOptions ToRegistrationOptions(
    const store::v1::RegistrationOptions& options);

// What is not set, or 0 without being optional, stands for the default.
spacetime::BuildOptions ToBuildOptions(const store::v1::SpaceTimeOptions& options);
int NumCoarserLevels(const store::v1::SpaceTimeOptions& options);

// Of a level of detail, 0 the finest: always a rebuilt one beyond that, on a coarser grid.
spacetime::BuildOptions ToLevelOptions(const store::v1::SpaceTimeOptions& options, int level);

// All options of the job, so that nothing is begun that cannot be finished.
// Errors: kInvalidArgument with the first field out of range, and its value.
absl::Status CheckOptions(const store::v1::RegisterJob& job);

// Those of one target; seconds become frames.
std::vector<registration::Correspondence> ToCorrespondences(const store::v1::RegisterJob& job,
                                                            int target_index,
                                                            double frames_per_second);

}  // namespace liquidblend::jobs
