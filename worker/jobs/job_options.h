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

// Options of the space-time mesh. A field that is not set, or 0 and not optional, has the default.
spacetime::BuildOptions ToBuildOptions(const store::v1::SpaceTimeOptions& options);
int NumCoarserLevels(const store::v1::SpaceTimeOptions& options);

// Options of the mesh of a level of detail. Level 0 is the finest; the meshes of the others are
// rebuilt on coarser grids.
spacetime::BuildOptions ToLevelOptions(const store::v1::SpaceTimeOptions& options, int level);

// Checks all options of the job before its work begins.
// Errors: kInvalidArgument with the first field out of range, and its value.
absl::Status CheckOptions(const store::v1::RegisterJob& job);

// Correspondences of one target; seconds become frames.
std::vector<registration::Correspondence> ToCorrespondences(const store::v1::RegisterJob& job,
                                                            int target_index,
                                                            double frames_per_second);

}  // namespace liquidblend::jobs
